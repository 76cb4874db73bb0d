//! What a mesh can be asked to minimise, by which length all terms measure, and what they check.

use crate::error::{GeometryError, Result};
use crate::mesh::TriangleMesh;
use glam::DVec3;

/// One energy term of the mesh solver: a weighted, possibly robust sum of squared residuals of the vertex positions.
///
/// Every residual is without unit (lengths are divided by the template's mean edge length, see
/// [`mean_edge_length`](super::mean_edge_length), or by a standard deviation), so that weights mean the same in
/// any unit of length.
pub trait Energy {
    /// The term's name in the report.
    fn name(&self) -> &'static str;

    /// Shows every set of vertices that one residual depends on, if they are not all of one edge or face (the default: none).
    fn stencils(&self, visit: &mut dyn FnMut(&[usize])) {
        let _ = visit;
    }

    /// The energy of `vertices`: the sum of rho(residual^2). Infinite where it is not defined (a
    /// drawn point at or behind the camera).
    fn energy(&self, vertices: &[DVec3]) -> f64;

    /// Gives `sink` every residual with its Jacobian at `vertices`. The gradients of the residuals,
    /// weighted and summed, are half the energy's gradient.
    fn linearize(&self, vertices: &[DVec3], sink: &mut dyn ResidualSink);

    /// Adds J^T W r'' to `gradient`, with r'' the second derivative of the residuals at `vertices` along the straight
    /// path with `velocity`. With it a step follows the valley that the term leaves open instead of its tangent. Terms
    /// whose residuals are nearly linear over a step need none (the default).
    fn add_curvature(&self, vertices: &[DVec3], velocity: &[DVec3], gradient: &mut [DVec3]) {
        let _ = (vertices, velocity, gradient);
    }
}

/// What takes the linearised residuals: the normal equations, or a test.
pub trait ResidualSink {
    /// A residual that is a number, its weight (the robust one included), and its gradient with respect
    /// to each vertex it depends on. No vertex stands twice.
    fn scalar(&mut self, residual: f64, weight: f64, gradient: &[(usize, DVec3)]);

    /// A residual that is a vector and its weight: the sum of coefficient times position over vertices,
    /// less something constant. No vertex stands twice.
    fn vector(&mut self, residual: DVec3, weight: f64, coefficients: &[(usize, f64)]);
}

/// How much a large residual counts (an M-estimator). The scale has the residual's unit and is where a
/// residual starts to count as an outlier.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[non_exhaustive]
pub enum Robust {
    /// Squares: rho(s) = s.
    #[default]
    Squares,
    /// c^2 ln(1 + s / c^2): a far outlier counts for next to nothing (the paper's M-estimator).
    Cauchy(f64),
}

/// A product beyond which no more factors are multiplied: far from what an f64 holds.
const LARGE: f64 = 1e150;

impl Robust {
    /// rho of a squared residual.
    pub fn rho(self, square: f64) -> f64 {
        match self {
            Self::Squares => square,
            Self::Cauchy(scale) => scale * scale * (square / (scale * scale)).ln_1p(),
        }
    }

    /// The sum of rho over squared residuals: one logarithm for many of them.
    pub(crate) fn sum(self, squares: impl Iterator<Item = f64>) -> f64 {
        match self {
            Self::Squares => squares.sum(),
            Self::Cauchy(scale) => {
                let per_square = (scale * scale).recip();
                let (mut logarithm, mut product) = (0.0, 1.0);
                for square in squares {
                    product *= 1.0 + square * per_square;
                    if product > LARGE {
                        logarithm += f64::ln(product);
                        product = 1.0;
                    }
                }
                scale * scale * (logarithm + product.ln())
            }
        }
    }

    /// The derivative of rho: the weight of the residual in iteratively re-weighted least squares.
    pub fn weight(self, square: f64) -> f64 {
        match self {
            Self::Squares => 1.0,
            Self::Cauchy(scale) => 1.0 / (1.0 + square / (scale * scale)),
        }
    }
}

pub(crate) fn check_weight(term: &'static str, weight: f64) -> Result<()> {
    check(term, weight, weight >= 0.0)
}

/// The scale of a robust function, if it has one.
pub(crate) fn check_robust(term: &'static str, robust: Robust) -> Result<()> {
    match robust {
        Robust::Squares => Ok(()),
        Robust::Cauchy(scale) => check_scale(term, scale),
    }
}

pub(crate) fn check_scale(term: &'static str, scale: f64) -> Result<()> {
    check(term, scale, scale > 0.0)
}

fn check(term: &'static str, actual: f64, is_in_range: bool) -> Result<()> {
    match actual.is_finite() && is_in_range {
        true => Ok(()),
        false => Err(GeometryError::Weight { term, actual }),
    }
}

/// The mean edge length of `template`, in its unit: the lengths in all terms are divided by it.
///
/// # Errors
/// [`GeometryError::MeshWithoutExtent`] when the mesh has no edge of positive length.
pub fn mean_edge_length(template: &TriangleMesh) -> Result<f64> {
    let (edges, v) = (template.edges(), template.vertices());
    let sum: f64 = edges.iter().map(|&[a, b]| v[a].distance(v[b])).sum();
    let mean = sum / edges.len() as f64;
    let is_length = mean.is_finite() && mean > 0.0;
    is_length.then_some(mean).ok_or(GeometryError::MeshWithoutExtent)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_sum_over_residuals_is_that_of_each_and_infinite_where_one_is() {
        for robust in [Robust::Squares, Robust::Cauchy(0.8)] {
            let squares = || (0..3000).map(|k| f64::from(k).powi(2) * if k % 2 == 0 { 1e-9 } else { 1e3 });
            let each: f64 = squares().map(|s| robust.rho(s)).sum();
            assert!((robust.sum(squares()) / each - 1.0).abs() < 1e-12);
            assert_eq!(robust.sum(squares().chain([f64::INFINITY])), f64::INFINITY);
            assert!(robust.sum(squares().chain([f64::NAN])).is_nan());
        }
    }
}
