//! The loss of training step 1 for the compact network: registration and depth of the main block and of the refined maps,
//! the mask, and the bins.

use crate::data::BatchTensors;
use burn::tensor::{Tensor, activation};
use deepsft_network::{NetworkOutput, cross_entropy};
use serde::Serialize;

/// Weight of each term, and the width of the quadratic part of the robust loss.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct LossWeights {
    /// Refined registration and depth.
    pub refined: f64,
    /// The main block's own registration and depth (the paper's 1/2).
    pub main: f64,
    /// Bins of u, v and d together.
    pub bins: f64,
    /// Mask.
    pub mask: f64,
    /// Error up to which the smooth L1 loss is quadratic, in units of the unit square.
    pub beta: f64,
}

impl Default for LossWeights {
    fn default() -> Self {
        Self {
            refined: 4.0,
            main: 2.0,
            bins: 0.25,
            mask: 1.5,
            beta: 0.01,
        }
    }
}

/// The loss of `output` against `batch`, [1]: the weighted sum of the smooth L1 of the refined (u, v, d) and of the main
/// block's, the cross-entropy of the bins, summed over u, v, d, and the binary cross-entropy of the mask.
pub fn step_one_loss(output: NetworkOutput, batch: &BatchTensors, weights: &LossWeights) -> Tensor<1> {
    let coordinates = |predicted: Tensor<4>| {
        let error = smooth_l1(predicted - batch.cells.clone(), weights.beta).sum_dim(1);
        (error * batch.cell_weight.clone()).sum() / (batch.cell_weight.clone().sum() + 1.0)
    };
    let refined = coordinates(output.refined);
    let main = coordinates(output.main);
    let [u, v, d] = output.bins;
    let entropy = |logits, k: usize| cross_entropy(logits, batch.bin_targets[k].clone(), batch.bin_weight.clone());
    let bins = entropy(u, 0) + entropy(v, 1) + entropy(d, 2);
    let mask = binary_cross_entropy(output.mask, batch.mask.clone());
    refined * weights.refined + main * weights.main + bins * weights.bins + mask * weights.mask
}

/// |e| - beta / 2 beyond beta, e^2 / (2 beta) within, elementwise.
fn smooth_l1(error: Tensor<4>, beta: f64) -> Tensor<4> {
    let size = error.abs();
    let inner = size.clone().clamp_max(beta);
    // inner (size - inner / 2) / beta: both branches in one expression.
    inner.clone() * (size - inner / 2.0) / beta
}

/// Mean over all pixels of -[y ln s(x) + (1 - y) ln(1 - s(x))], s the logistic function, in the form
/// that does not overflow: relu(x) - x y + ln(1 + e^-|x|).
fn binary_cross_entropy(logits: Tensor<4>, target: Tensor<4>) -> Tensor<1> {
    let soft = (logits.clone().abs().neg().exp() + 1.0).log();
    (activation::relu(logits.clone()) - logits * target + soft).mean()
}
