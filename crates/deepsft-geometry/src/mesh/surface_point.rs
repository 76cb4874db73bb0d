//! Points on the template's faces, found by their place in the texture.

use super::triangle_mesh::TriangleMesh;
use glam::{DVec2, DVec3};
use std::ops::Range;

/// A point of the template's surface: a face and barycentric coordinates in it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfacePoint {
    /// Index of the face.
    pub face: usize,
    /// Weights of the face's corners; they sum to 1.
    pub barycentric: [f64; 3],
}

impl SurfacePoint {
    /// Where the point is when a mesh with these `faces` has its `vertices` there.
    ///
    /// # Panics
    /// When there is no such face or vertex.
    pub fn position(&self, faces: &[[usize; 3]], vertices: &[DVec3]) -> DVec3 {
        weighted(self.barycentric, faces[self.face].map(|v| vertices[v]))
    }

    /// The value there of a function that is linear on each face and has these `values` at the vertices.
    pub(crate) fn interpolated(&self, faces: &[[usize; 3]], values: &[f32]) -> f64 {
        let corners = faces[self.face].iter().zip(self.barycentric);
        corners.map(|(&v, w)| w * f64::from(values[v])).sum()
    }
}

/// The point of a triangle with these weights of its corners.
pub(crate) fn weighted(weights: [f64; 3], [a, b, c]: [DVec3; 3]) -> DVec3 {
    weights[0] * a + weights[1] * b + weights[2] * c
}

/// A surface point with its face looked up: three different vertices and their weights.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct AnchoredPoint {
    pub corners: [usize; 3],
    pub barycentric: [f64; 3],
}

impl AnchoredPoint {
    /// Looks the face up. `None` for a face that is not there or names a vertex twice and weights that are not finite:
    /// nothing can be measured there.
    pub(crate) fn new(template: &TriangleMesh, point: SurfacePoint) -> Option<Self> {
        let corners @ [a, b, c] = *template.faces().get(point.face)?;
        let usable = a != b && b != c && c != a && point.barycentric.iter().all(|w| w.is_finite());
        usable.then_some(Self {
            corners,
            barycentric: point.barycentric,
        })
    }

    pub(crate) fn position(&self, vertices: &[DVec3]) -> DVec3 {
        weighted(self.barycentric, self.corners.map(|v| vertices[v]))
    }

    /// The gradient with respect to the corners of a function with `gradient` at the point.
    pub(crate) fn spread(&self, gradient: DVec3) -> [(usize, DVec3); 3] {
        std::array::from_fn(|k| (self.corners[k], self.barycentric[k] * gradient))
    }
}

/// A position this far outside a face (as a barycentric coordinate) still belongs to it: a registration may
/// point just past the print's edge, and rounding must leave no gap between faces.
const TOLERANCE: f64 = 1e-6;

/// Finds the face under a texture position. For templates whose charts do not overlap.
#[derive(Clone, Debug)]
pub struct SurfaceLocator {
    corners: Vec<[DVec2; 3]>,
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

/// Cells along each side of the grid over the unit square.
const CELLS: usize = 64;

/// Numbers of things (faces, vertices) by the cells of a grid over the texture.
#[derive(Clone, Debug)]
pub(crate) struct TextureGrid {
    cells: Vec<Vec<u32>>,
}

impl TextureGrid {
    pub(crate) fn new() -> Self {
        Self {
            cells: vec![Vec::new(); CELLS * CELLS],
        }
    }

    /// Puts `number` into all cells between two corners.
    pub(crate) fn insert(&mut self, low: DVec2, high: DVec2, number: usize) {
        let (columns, rows) = Self::cells(low, high);
        for row in rows {
            for cell in &mut self.cells[row * CELLS..][columns.clone()] {
                cell.push(number as u32);
            }
        }
    }

    /// The columns and rows of cells between two corners, clamped into the grid.
    pub(crate) fn cells(low: DVec2, high: DVec2) -> (Range<usize>, Range<usize>) {
        let index = |t: f64| ((t * CELLS as f64).max(0.0) as usize).min(CELLS - 1);
        (index(low.x)..index(high.x) + 1, index(low.y)..index(high.y) + 1)
    }

    pub(crate) fn cell(&self, column: usize, row: usize) -> impl Iterator<Item = usize> + '_ {
        self.cells[row * CELLS + column].iter().map(|&number| number as usize)
    }
}

/// Gives the barycentric coordinates of `uv` in a triangle of the texture. Not finite in one without area.
pub fn texture_barycentric(uv: DVec2, [a, b, c]: [DVec2; 3]) -> [f64; 3] {
    let area = (b - a).perp_dot(c - a);
    let second = (uv - a).perp_dot(c - a) / area;
    let third = (b - a).perp_dot(uv - a) / area;
    [1.0 - second - third, second, third]
}
