//! How far a deformation is from an isometry.

use deepsft_geometry::{TriangleMesh, glam::DVec3};

/// Relative change |l / l0 - 1| of a mesh's edge lengths under a deformation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EdgeLengthChange {
    /// Median over the edges, each counted once.
    pub median: f64,
    /// 95th percentile over the edges.
    pub p95: f64,
}

impl EdgeLengthChange {
    /// Median and 95th percentile (nearest rank) of the given changes; zeros when there are none.
    pub fn of(mut changes: Vec<f64>) -> Self {
        Self {
            median: percentile(&mut changes, 0.5),
            p95: percentile(&mut changes, 0.95),
        }
    }
}

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

fn percentile(values: &mut [f64], share: f64) -> f64 {
    if values.is_empty() {
        return 0.0;
    }
    let rank = ((values.len() as f64 * share).ceil() as usize).clamp(1, values.len()) - 1;
    *values.select_nth_unstable_by(rank, f64::total_cmp).1
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_95th_of_a_hundred_changes_is_the_nearest_rank() {
        let change = EdgeLengthChange::of((1..=100).rev().map(f64::from).collect());
        assert_eq!(
            change,
            EdgeLengthChange {
                median: 50.0,
                p95: 95.0
            }
        );
        assert_eq!(
            EdgeLengthChange::of(Vec::new()),
            EdgeLengthChange { median: 0.0, p95: 0.0 }
        );
    }
}
