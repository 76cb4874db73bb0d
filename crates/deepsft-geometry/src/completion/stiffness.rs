//! The matrix of ARAP completion, and L-BFGS around a solve with it.

use crate::error::Result;
use crate::solver::arap_cells::ArapCells;
use crate::solver::cholesky::SparseCholesky;
use glam::DVec3;
use std::collections::VecDeque;

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
    pub(super) fn new(prior: &ArapCells, weight: f64) -> Result<Self> {
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
    pub(super) fn factorize(&mut self, holds: &[f64]) -> Result<()> {
        self.held.copy_from_slice(&self.laplacian);
        for (start, hold) in self.cholesky.column_starts.iter().zip(holds) {
            self.held[*start] += hold;
        }
        self.cholesky.factorize(&self.held)
    }

    pub(super) fn solve(&mut self, right_hand_side: &[DVec3], solution: &mut [DVec3]) {
        self.cholesky.solve_points(right_hand_side, solution);
    }
}

/// Pairs of (step, change of gradient) that are remembered. Beyond 5 the count of iterations no longer
/// falls (Liu et al. 2017 find the same).
const MEMORY: usize = 5;

/// The two loops of L-BFGS (Nocedal 1980) with a factorised matrix in the middle, as in Liu et al. 2017,
/// *Quasi-Newton Methods for Real-Time Simulation of Hyperelastic Materials*.
#[derive(Debug, Default)]
pub(super) struct QuasiNewton {
    /// Steps, changes of the gradient, and the product of both, positive: the newest first.
    pairs: VecDeque<(Vec<DVec3>, Vec<DVec3>, f64)>,
}

impl QuasiNewton {
    /// Writes the step from a place with this `gradient`.
    pub(super) fn direction(&self, matrix: &mut Stiffness, gradient: &[DVec3], direction: &mut [DVec3]) {
        let mut right: Vec<DVec3> = gradient.iter().map(|g| -*g).collect();
        let mut alphas = [0.0; MEMORY];
        for ((step, change, curvature), alpha) in self.pairs.iter().zip(&mut alphas) {
            *alpha = dot(step, &right) / curvature;
            add_scaled(&mut right, -*alpha, change);
        }
        matrix.solve(&right, direction);
        for ((step, change, curvature), alpha) in self.pairs.iter().zip(&alphas).rev() {
            let beta = dot(change, direction) / curvature;
            add_scaled(direction, alpha - beta, step);
        }
    }

    /// Remembers that `fraction` of `step` led from a gradient to another.
    pub(super) fn remember(&mut self, step: &[DVec3], fraction: f64, before: &[DVec3], after: &[DVec3]) {
        let step: Vec<DVec3> = step.iter().map(|s| fraction * *s).collect();
        let change: Vec<DVec3> = after.iter().zip(before).map(|(a, b)| a - b).collect();
        let curvature = dot(&step, &change);
        self.pairs.truncate(MEMORY - 1);
        if curvature > 0.0 {
            self.pairs.push_front((step, change, curvature));
        }
    }
}

pub(super) fn dot(a: &[DVec3], b: &[DVec3]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a.dot(*b)).sum()
}

fn add_scaled(to: &mut [DVec3], factor: f64, what: &[DVec3]) {
    to.iter_mut().zip(what).for_each(|(t, w)| *t += factor * *w);
}
