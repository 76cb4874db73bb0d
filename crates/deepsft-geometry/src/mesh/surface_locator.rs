//! From texture positions to points of the mesh.

use super::surface_point::SurfacePoint;
use super::texture_grid::{TextureGrid, texture_barycentric};
use super::triangle_mesh::TriangleMesh;
use glam::DVec2;

/// A position this far outside a face (as a barycentric coordinate) still belongs to it: a registration may
/// point just past the print's edge, and rounding must leave no gap between faces.
const TOLERANCE: f64 = 1e-6;

/// Finds the face under a texture position. For templates whose charts do not overlap.
#[derive(Clone, Debug)]
pub struct SurfaceLocator {
    /// Corners' texture coordinates of each face.
    corners: Vec<[DVec2; 3]>,
    /// The faces by their place in the texture.
    grid: TextureGrid,
}

impl SurfaceLocator {
    /// Sorts the faces of `mesh` into a grid. Faces without area in the texture are left out.
    pub fn new(mesh: &TriangleMesh) -> Self {
        let uv = mesh.texture_coordinates();
        let corners: Vec<[DVec2; 3]> = mesh.faces().iter().map(|face| face.map(|v| uv[v])).collect();
        let mut grid = TextureGrid::new();
        for (face, &[a, b, c]) in corners.iter().enumerate() {
            if (b - a).perp_dot(c - a) != 0.0 {
                grid.insert(a.min(b).min(c), a.max(b).max(c), face);
            }
        }
        Self { corners, grid }
    }

    /// The point of the surface at texture position `uv`; `None` where the texture covers no face.
    pub fn locate(&self, uv: DVec2) -> Option<SurfacePoint> {
        if !uv.is_finite() {
            return None;
        }
        let (columns, rows) = TextureGrid::cells(uv, uv);
        self.grid.cell(columns.start, rows.start).find_map(|face| {
            let barycentric = texture_barycentric(uv, self.corners[face]);
            let inside = barycentric.iter().all(|&w| w >= -TOLERANCE);
            inside.then_some(SurfacePoint { face, barycentric })
        })
    }
}
