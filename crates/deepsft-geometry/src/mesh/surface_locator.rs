//! From texture positions to points of the mesh.

use super::surface_point::SurfacePoint;
use super::triangle_mesh::TriangleMesh;
use glam::DVec2;

/// Cells a side of the grid over the unit square.
const CELLS: usize = 64;

/// A position this far outside a face (as a barycentric coordinate) still belongs to it: a registration may
/// point just past the print's edge, and rounding must leave no gap between faces.
const TOLERANCE: f64 = 1e-6;

/// Finds the face under a texture position. For templates whose charts do not overlap.
#[derive(Clone, Debug)]
pub struct SurfaceLocator {
    /// Corners' texture coordinates of each face.
    corners: Vec<[DVec2; 3]>,
    /// Faces that may cover each cell.
    cells: Vec<Vec<u32>>,
}

impl SurfaceLocator {
    /// Sorts the faces of `mesh` into a grid. Faces without area in the texture are left out.
    pub fn new(mesh: &TriangleMesh) -> Self {
        let uv = mesh.texture_coordinates();
        let corners: Vec<[DVec2; 3]> = mesh.faces().iter().map(|face| face.map(|v| uv[v])).collect();
        let mut cells = vec![Vec::new(); CELLS * CELLS];
        for (face, &[a, b, c]) in corners.iter().enumerate() {
            if (b - a).perp_dot(c - a) == 0.0 {
                continue;
            }
            let (low, high) = (cell(a.min(b).min(c)), cell(a.max(b).max(c)));
            for row in low.1..=high.1 {
                for column in low.0..=high.0 {
                    cells[row * CELLS + column].push(face as u32);
                }
            }
        }
        Self { corners, cells }
    }

    /// The point of the surface at texture position `uv`; `None` where the texture covers no face.
    pub fn locate(&self, uv: DVec2) -> Option<SurfacePoint> {
        if !uv.is_finite() {
            return None;
        }
        let (column, row) = cell(uv);
        self.cells[row * CELLS + column].iter().find_map(|&face| {
            let [a, b, c] = self.corners[face as usize];
            let area = (b - a).perp_dot(c - a);
            let second = (uv - a).perp_dot(c - a) / area;
            let third = (b - a).perp_dot(uv - a) / area;
            let barycentric = [1.0 - second - third, second, third];
            barycentric.iter().all(|&w| w >= -TOLERANCE).then_some(SurfacePoint {
                face: face as usize,
                barycentric,
            })
        })
    }
}

/// The cell (column, row) of a position, clamped into the grid.
fn cell(uv: DVec2) -> (usize, usize) {
    let index = |t: f64| ((t * CELLS as f64).max(0.0) as usize).min(CELLS - 1);
    (index(uv.x), index(uv.y))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::image::Picture;
    use crate::mesh::Template;

    #[test]
    fn every_position_of_a_sheet_is_found_and_leads_back() {
        let template = Template::thin_shell(Picture::from_fn(1, 1, |_, _| [0; 3]), 297.0, 210.0).unwrap();
        let mesh = template.mesh();
        let locator = SurfaceLocator::new(mesh);
        for i in 0..=100 {
            for j in 0..=100 {
                let uv = DVec2::new(f64::from(i) / 100.0, f64::from(j) / 100.0);
                let point = locator.locate(uv).unwrap();
                let back: DVec2 = (mesh.faces()[point.face].iter().zip(point.barycentric))
                    .map(|(&v, w)| w * mesh.texture_coordinates()[v])
                    .sum();
                assert!(back.distance(uv) < 1e-9);
            }
        }
        assert_eq!(locator.locate(DVec2::new(1.1, 0.5)), None);
        assert_eq!(locator.locate(DVec2::NAN), None);
    }
}
