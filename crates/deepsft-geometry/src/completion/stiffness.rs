//! The matrix of ARAP completion.

use crate::error::GeometryError;
use crate::solver::arap_cells::ArapCells;
use crate::solver::cholesky::SparseCholesky;
use glam::DVec3;

/// The n x n matrix that the three coordinates fraction: the cotangent Laplacian, weighted, and on its diagonal what
/// holds each vertex. Analysed once per template, factorised once per frame.
#[derive(Debug)]
pub(super) struct Stiffness {
    cholesky: SparseCholesky,
    /// Without holds, in the pattern's order.
    laplacian: Vec<f64>,
    /// With the holds of the last factorisation.
    held: Vec<f64>,
}

impl Stiffness {
    /// `weight` times the Laplacian of the cells.
    pub(super) fn new(prior: &ArapCells, weight: f64) -> Result<Self, GeometryError> {
        let n = prior.vertices();
        let (mut starts, mut rows, mut laplacian) = (vec![0], vec![], vec![]);
        for i in 0..n {
            rows.push(i);
            laplacian.push(weight * prior.degrees[i]);
            for (j, edge, _) in prior.edges(i).filter(|edge| edge.0 > i) {
                rows.push(j);
                laplacian.push(-weight * edge);
            }
            starts.push(rows.len());
        }
        Ok(Self {
            cholesky: SparseCholesky::new(starts, rows)?,
            held: laplacian.clone(),
            laplacian,
        })
    }

    /// The diagonal entry of vertex `i`, without holds.
    pub(super) fn diagonal(&self, i: usize) -> f64 {
        self.laplacian[self.cholesky.column_starts[i]]
    }

    /// Factorises with `holds` on the diagonal, one per vertex.
    pub(super) fn factorize(&mut self, holds: &[f64]) -> Result<(), GeometryError> {
        self.held.copy_from_slice(&self.laplacian);
        for (start, hold) in self.cholesky.column_starts.iter().zip(holds) {
            self.held[*start] += hold;
        }
        self.cholesky.factorize(&self.held)
    }

    /// Solves for three coordinates with the last factorisation.
    pub(super) fn solve(&mut self, right_hand_side: &[DVec3], solution: &mut [DVec3]) {
        self.cholesky.solve_points(right_hand_side, solution);
    }
}
