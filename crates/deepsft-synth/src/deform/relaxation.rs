//! Position-based relaxation: vertices move until the mesh's edges have their rest length again.

use deepsft_geometry::{Template, glam::DVec3};
use serde::Serialize;

/// Fraction of the error of a row's or column's second difference that one sweep removes: high enough
/// to keep compressed edges from buckling into zigzags, low enough that edge lengths win.
const SHAPE_STIFFNESS: f64 = 0.3;

/// The constraints of a thin shell's grid: the rest length of every mesh edge, and the bent shape.
#[derive(Clone, Debug)]
pub(crate) struct Relaxation {
    edges: Vec<[usize; 2]>,
    /// Squared rest length of each edge, mm^2.
    rest_squared: Vec<f64>,
    /// Triples of neighbours in the grid's rows and columns.
    triples: Vec<[usize; 3]>,
}

impl Relaxation {
    pub(crate) fn new(template: &Template) -> Self {
        // Only a grid has rows and columns to keep in shape.
        let (columns, rows) = template.grid().unwrap_or((1, 1));
        let edges = template.mesh().edges();
        let rest = template.mesh().vertices();
        let rest_squared = edges.iter().map(|&[a, b]| rest[a].distance_squared(rest[b])).collect();
        let along_rows = (0..rows).flat_map(|j| (1..columns - 1).map(move |i| (j * columns + i, 1)));
        let along_columns = (1..rows - 1).flat_map(|j| (0..columns).map(move |i| (j * columns + i, columns)));
        let triples = along_rows
            .chain(along_columns)
            .map(|(k, step)| [k - step, k, k + step])
            .collect();
        Self {
            edges,
            rest_squared,
            triples,
        }
    }

    /// How far the edges' lengths are from those at `rest`.
    pub(crate) fn change(&self, rest: &[DVec3], vertices: &[DVec3]) -> EdgeLengthChange {
        EdgeLengthChange::between(rest, &self.edges, vertices)
    }

    /// Runs `sweeps` Gauss-Seidel sweeps over all constraints, every second one in reverse order so
    /// that a shift travels through the whole sheet both ways.
    pub(crate) fn relax(&self, vertices: &mut [DVec3], sweeps: usize) {
        let bent = self.second_differences(vertices);
        for sweep in 0..sweeps {
            // The shape is let go towards the end: the last quarter of the sweeps is for lengths only.
            if sweep * 4 < sweeps * 3 {
                self.keep_shape(vertices, &bent);
            }
            let constraints = self.edges.iter().zip(&self.rest_squared);
            if sweep % 2 == 0 {
                constraints.for_each(|(edge, rest)| keep_length(vertices, *edge, *rest));
            } else {
                constraints
                    .rev()
                    .for_each(|(edge, rest)| keep_length(vertices, *edge, *rest));
            }
        }
    }

    fn second_differences(&self, vertices: &[DVec3]) -> Vec<DVec3> {
        self.triples
            .iter()
            .map(|&[a, b, c]| vertices[a] - 2.0 * vertices[b] + vertices[c])
            .collect()
    }

    fn keep_shape(&self, vertices: &mut [DVec3], bent: &[DVec3]) {
        for (&[a, b, c], target) in self.triples.iter().zip(bent) {
            // The gradient of a - 2 b + c has squared norm 1 + 4 + 1 = 6.
            let error = vertices[a] - 2.0 * vertices[b] + vertices[c] - *target;
            let correction = error * (SHAPE_STIFFNESS / 6.0);
            vertices[a] -= correction;
            vertices[b] += 2.0 * correction;
            vertices[c] -= correction;
        }
    }
}

/// Moves both ends of an edge so that it has its rest length, to first order around it (one division
/// in place of a square root: Jakobsen, "Advanced character physics", 2001).
fn keep_length(vertices: &mut [DVec3], [a, b]: [usize; 2], rest_squared: f64) {
    let edge = vertices[b] - vertices[a];
    let correction = edge * (rest_squared / (edge.length_squared() + rest_squared) - 0.5);
    vertices[a] -= correction;
    vertices[b] += correction;
}

/// Relative change |l / l0 - 1| of a mesh's edge lengths under a deformation.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct EdgeLengthChange {
    /// Median over the edges, each counted once.
    pub median: f64,
    /// 95th percentile over the edges.
    pub p95: f64,
}

impl EdgeLengthChange {
    /// Median and 95th percentile (nearest rank) over `edges` from `rest` to `deformed`, but for edges whose rest length is zero.
    pub(crate) fn between(rest: &[DVec3], edges: &[[usize; 2]], deformed: &[DVec3]) -> Self {
        Self::of(edge_length_changes(rest, edges, deformed))
    }

    /// Of the given changes; zeros when there are none.
    pub(crate) fn of(mut changes: Vec<f64>) -> Self {
        let mut percentile = |fraction: f64| {
            let rank = (changes.len() as f64 * fraction).ceil().max(1.0) as usize - 1;
            match rank < changes.len() {
                true => *changes.select_nth_unstable_by(rank, f64::total_cmp).1,
                false => 0.0,
            }
        };
        Self {
            median: percentile(0.5),
            p95: percentile(0.95),
        }
    }
}

/// |l / l0 - 1| of each edge whose rest length is not zero.
fn edge_length_changes(rest: &[DVec3], edges: &[[usize; 2]], deformed: &[DVec3]) -> Vec<f64> {
    let changes = edges.iter().filter_map(|&[a, b]| {
        let rest_length = rest[a].distance(rest[b]);
        (rest_length > 0.0).then(|| (deformed[a].distance(deformed[b]) / rest_length - 1.0).abs())
    });
    changes.collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use deepsft_geometry::Picture;

    #[test]
    fn the_95th_of_a_hundred_changes_is_the_nearest_rank() {
        let change = EdgeLengthChange::of((1..=100).rev().map(f64::from).collect());
        assert_eq!((change.median, change.p95), (50.0, 95.0));
        let nothing = EdgeLengthChange::of(Vec::new());
        assert_eq!((nothing.median, nothing.p95), (0.0, 0.0));
    }

    #[test]
    fn edges_that_a_sharp_fold_cuts_short_recover_their_length() {
        // A fold of 1 rad through the middle of the cells between columns 15 and 16 leaves the
        // horizontal edges there a chord of cos(0.5) = 0.878 of their length.
        let template = Template::thin_shell(Picture::from_fn(1, 1, |_, _| [0; 3]), 297.0, 210.0).unwrap();
        let rest = template.mesh().vertices();
        let fold = (rest[15].x + rest[16].x) / 2.0;
        let folded = |p: &DVec3| {
            let beyond = (p.x - fold).max(0.0);
            DVec3::new(p.x.min(fold) + beyond * 1.0_f64.cos(), p.y, beyond * 1.0_f64.sin())
        };
        let mut vertices: Vec<DVec3> = rest.iter().map(folded).collect();
        let worst = |vertices: &[DVec3]| {
            let changes = edge_length_changes(rest, &template.mesh().edges(), vertices);
            changes.into_iter().fold(0.0, f64::max)
        };
        let cut = 1.0 - 0.5_f64.cos();
        assert!((worst(&vertices) - cut).abs() < 1e-12);
        let far_before = vertices[30].distance(vertices[0]);
        Relaxation::new(&template).relax(&mut vertices, 40);
        assert!(worst(&vertices) < 0.01, "{}", worst(&vertices));
        // The corners' distance grows by no more than the length recovered.
        let recovered = cut * (rest[16].x - rest[15].x);
        assert!((vertices[30].distance(vertices[0]) - far_before).abs() < 2.0 * recovered);
    }
}
