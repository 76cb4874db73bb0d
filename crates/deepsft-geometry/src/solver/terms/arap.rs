//! As rigid as possible: the paper's E_arap and E_smooth as a term of the mesh solver.

use super::arap_cells::{ArapCells, Rotations};
use crate::error::GeometryError;
use crate::mesh::TriangleMesh;
use crate::solver::checked::check_weight;
use crate::solver::energy::{Energy, ResidualSink};
use crate::solver::mean_edge_length::mean_edge_length;
use glam::DVec3;

/// Weight of E_arap in the paper's equation `arap`.
pub const PAPER_ARAP_WEIGHT: f64 = 20.0;

/// Weight of E_smooth in the paper's equation `arap`.
pub const PAPER_SMOOTHNESS_WEIGHT: f64 = 0.005;

/// lambda_a E_arap + lambda_s E_smooth, lengths divided by the mean edge length. E_arap is that of Sorkine
/// and Alexa 2007 (cotangent weights, clamped to be positive), E_smooth the deviation of
/// the Laplacian from the template's (our reading of the paper's section on ARAP). They share the
/// cells' rotations, which are optimised at every evaluation; in the Jacobian they are held, which
/// leaves the gradient exact.
#[derive(Clone, Debug)]
pub struct Arap {
    prior: ArapCells,
    per_length: f64,
}

impl Arap {
    /// For the edges of `template`, with the weights of E_arap and of E_smooth. Without smoothness the
    /// solver couples only neighbours and is about three times faster.
    ///
    /// # Errors
    /// [`GeometryError::Weight`] for a weight that is negative or not finite, [`GeometryError::MeshWithoutExtent`].
    pub fn new(template: &TriangleMesh, weight: f64, smoothness_weight: f64) -> Result<Self, GeometryError> {
        check_weight("arap", weight)?;
        check_weight("smoothness", smoothness_weight)?;
        Ok(Self {
            prior: ArapCells::new(template, weight, smoothness_weight),
            per_length: mean_edge_length(template)?.recip(),
        })
    }
}

impl Energy for Arap {
    fn name(&self) -> &'static str {
        "arap"
    }

    fn stencils(&self, visit: &mut dyn FnMut(&[usize])) {
        let mut stencil = Vec::new();
        for i in 0..self.prior.vertices() {
            if self.prior.smoothness > 0.0 {
                stencil.clear();
                stencil.push(i);
                stencil.extend(self.prior.neighbours(i).map(|n| n.0));
                visit(&stencil);
            }
        }
    }

    fn energy(&self, vertices: &[DVec3]) -> f64 {
        let energy = self.prior.cells(vertices, Rotations::Best, |_, _, _| {});
        let weighted = self.prior.arap * energy.arap + self.prior.smoothness * energy.smoothness;
        weighted * self.per_length * self.per_length
    }

    fn linearize(&self, vertices: &[DVec3], sink: &mut dyn ResidualSink) {
        let mut row = Vec::new();
        let per_length = self.per_length;
        self.prior.cells(vertices, Rotations::Best, |i, residuals, sum| {
            for ((j, weight), residual) in self.prior.neighbours(i).zip(residuals) {
                let coefficients = [(i, per_length), (j, -per_length)];
                sink.vector(*residual * per_length, self.prior.arap * weight, &coefficients);
            }
            let degree = self.prior.degree(i);
            if self.prior.smoothness > 0.0 && degree > 0.0 {
                row.clear();
                row.push((i, degree * per_length));
                row.extend(self.prior.neighbours(i).map(|(j, weight)| (j, -weight * per_length)));
                sink.vector(sum * per_length, self.prior.smoothness / degree, &row);
            }
        });
    }
}
