//! The length by which all terms measure.

use crate::error::GeometryError;
use crate::mesh::TriangleMesh;

/// The mean edge length of `template`, in its unit: the lengths in all terms are divided by it.
///
/// # Errors
/// [`GeometryError::MeshWithoutExtent`] when the mesh has no edge of positive length.
pub fn mean_edge_length(template: &TriangleMesh) -> Result<f64, GeometryError> {
    let (edges, v) = (template.edges(), template.vertices());
    let sum: f64 = edges.iter().map(|&[a, b]| v[a].distance(v[b])).sum();
    let mean = sum / edges.len() as f64;
    let is_length = mean.is_finite() && mean > 0.0;
    is_length.then_some(mean).ok_or(GeometryError::MeshWithoutExtent)
}
