//! The direction of a step: L-BFGS around a solve with a factorised matrix.

use super::stiffness::Stiffness;
use glam::DVec3;
use std::collections::VecDeque;

/// Pairs of (step, change of gradient) that are remembered. Beyond 5 the count of iterations no longer
/// falls (Liu et al. 2017 find the same).
const MEMORY: usize = 5;

/// The two loops of L-BFGS (Nocedal 1980) with a factorised matrix in the middle, as in Liu et al. 2017,
/// *Quasi-Newton Methods for Real-Time Simulation of Hyperelastic Materials*.
#[derive(Debug, Default)]
pub(super) struct QuasiNewton {
    /// Newest first.
    pairs: VecDeque<Pair>,
}

#[derive(Debug)]
struct Pair {
    step: Vec<DVec3>,
    change: Vec<DVec3>,
    /// Their product, positive.
    curvature: f64,
}

impl QuasiNewton {
    /// Writes the step from a place with this `gradient`.
    pub(super) fn direction(&self, matrix: &mut Stiffness, gradient: &[DVec3], direction: &mut [DVec3]) {
        let mut right: Vec<DVec3> = gradient.iter().map(|g| -*g).collect();
        let mut alphas = [0.0; MEMORY];
        for (pair, alpha) in self.pairs.iter().zip(&mut alphas) {
            *alpha = dot(&pair.step, &right) / pair.curvature;
            add_scaled(&mut right, -*alpha, &pair.change);
        }
        matrix.solve(&right, direction);
        for (pair, alpha) in self.pairs.iter().zip(&alphas).rev() {
            let beta = dot(&pair.change, direction) / pair.curvature;
            add_scaled(direction, alpha - beta, &pair.step);
        }
    }

    /// Remembers that `fraction` of `step` led from a gradient to another.
    pub(super) fn remember(&mut self, step: &[DVec3], fraction: f64, before: &[DVec3], after: &[DVec3]) {
        let step: Vec<DVec3> = step.iter().map(|s| fraction * *s).collect();
        let change: Vec<DVec3> = after.iter().zip(before).map(|(a, b)| a - b).collect();
        let curvature = dot(&step, &change);
        self.pairs.truncate(MEMORY - 1);
        if curvature > 0.0 {
            self.pairs.push_front(Pair {
                step,
                change,
                curvature,
            });
        }
    }
}

pub(super) fn dot(a: &[DVec3], b: &[DVec3]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a.dot(*b)).sum()
}

fn add_scaled(to: &mut [DVec3], factor: f64, what: &[DVec3]) {
    to.iter_mut().zip(what).for_each(|(t, w)| *t += factor * *w);
}
