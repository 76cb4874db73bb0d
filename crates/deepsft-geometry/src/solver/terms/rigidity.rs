//! A shape that is as rigid as possible.

use crate::error::GeometryError;
use crate::solver::arap_cells::ArapCells;
use crate::solver::energy::{Energy, ResidualSink, check_weight};
use glam::{DMat3, DVec3};

/// As-rigid-as-possible deformation (Sorkine and Alexa 2007) of points: weight times the sum over points i and their neighbours j of
/// w_ij |(p_i - p_j) - R_i (q_i - q_j)|^2 / (mean edge length)^2, q at rest. w_ij falls with the square of the edge's length. R_i is the
/// best rotation of a point and its neighbours. It resists stretching and bending, whatever the shape at rest.
///
/// A step takes the rotations as they are at its start. That overestimates how stiff the shape is, so a step never goes too far.
#[derive(Clone, Debug)]
pub(crate) struct Rigidity {
    cells: ArapCells,
    weight: f64,
    per_length: f64,
}

impl Rigidity {
    /// For `edges` between `points` at rest.
    pub(crate) fn new(points: &[DVec3], edges: &[[usize; 2]], weight: f64) -> Result<Self, GeometryError> {
        check_weight("rigidity", weight)?;
        let length = edges.iter().map(|[a, b]| points[*a].distance(points[*b])).sum::<f64>() / edges.len() as f64;
        Ok(Self {
            cells: ArapCells::of_edges(points, edges, 1.0),
            weight,
            per_length: length.recip(),
        })
    }

    /// Shows the residual of each edge of each point, from `i` to `j`, with its weight `w`.
    fn residuals(&self, points: &[DVec3], mut show: impl FnMut([usize; 2], f64, DVec3)) {
        for (i, rotation) in self.cells.rotations(points).into_iter().enumerate() {
            let rotation = DMat3::from_quat(rotation);
            for (j, w, rest) in self.cells.edges(i) {
                show([i, j], w, (points[i] - points[j] - rotation * rest) * self.per_length);
            }
        }
    }
}

impl Energy for Rigidity {
    fn name(&self) -> &'static str {
        "rigidity"
    }

    fn energy(&self, points: &[DVec3]) -> f64 {
        let mut sum = 0.0;
        self.residuals(points, |_, w, residual| sum += w * residual.length_squared());
        self.weight * sum
    }

    fn linearize(&self, points: &[DVec3], sink: &mut dyn ResidualSink) {
        let per_length = self.per_length;
        self.residuals(points, |[i, j], w, residual| {
            sink.vector(residual, self.weight * w, &[(i, per_length), (j, -per_length)]);
        });
    }
}
