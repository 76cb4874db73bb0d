//! Points on the template's faces.

use super::triangle_mesh::TriangleMesh;
use glam::DVec3;

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
