//! The length by which all terms measure.

use crate::error::GeometryError;
use crate::mesh::TriangleMesh;

/// The template's mean rest edge length, by which the lengths in all terms are divided.
#[derive(Clone, Copy, Debug, PartialEq, PartialOrd)]
pub struct LengthScale(f64);

impl LengthScale {
    /// The mean edge length of `template`, in its unit.
    ///
    /// # Errors
    /// [`GeometryError::MeshWithoutExtent`] when the mesh has no edge of positive length.
    pub fn of(template: &TriangleMesh) -> Result<Self, GeometryError> {
        let edges = template.edges();
        let v = template.vertices();
        let sum: f64 = edges.iter().map(|&[a, b]| v[a].distance(v[b])).sum();
        let mean = sum / edges.len() as f64;
        if mean.is_finite() && mean > 0.0 {
            Ok(Self(mean))
        } else {
            Err(GeometryError::MeshWithoutExtent)
        }
    }

    /// The length, in the template's unit.
    pub fn get(self) -> f64 {
        self.0
    }
}
