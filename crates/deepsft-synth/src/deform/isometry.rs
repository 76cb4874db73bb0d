//! How far a deformation is from an isometry.

use deepsft_formats::EdgeLengthChange;
use deepsft_geometry::{TriangleMesh, glam::DVec3};

/// The change of the edge lengths of `mesh` when its vertices move to `deformed` (same order, any
/// frame, mm). Edges of rest length zero do not count, nor do edges beyond the end of `deformed`.
///
/// ```
/// use deepsft_geometry::{TriangleMesh, glam::{DVec2, DVec3}};
/// use deepsft_synth::edge_length_change;
/// let mesh = TriangleMesh::new(vec![DVec3::ZERO, DVec3::X, DVec3::Y], vec![DVec2::ZERO; 3], vec![[0, 1, 2]])?;
/// let grown: Vec<DVec3> = mesh.vertices().iter().map(|v| *v * 1.25).collect();
/// assert_eq!(edge_length_change(&mesh, &grown).median, 0.25);
/// # Ok::<(), deepsft_geometry::GeometryError>(())
/// ```
pub fn edge_length_change(mesh: &TriangleMesh, deformed: &[DVec3]) -> EdgeLengthChange {
    EdgeLengthChange::of(edge_length_changes(mesh.vertices(), &mesh.edges(), deformed))
}

/// |l / l0 - 1| of each edge whose rest length is not zero.
pub(crate) fn edge_length_changes(rest: &[DVec3], edges: &[[usize; 2]], deformed: &[DVec3]) -> Vec<f64> {
    edges
        .iter()
        .filter_map(|&[a, b]| {
            let length = deformed.get(a)?.distance(*deformed.get(b)?);
            let rest_length = rest.get(a)?.distance(*rest.get(b)?);
            (rest_length > 0.0).then(|| (length / rest_length - 1.0).abs())
        })
        .collect()
}
