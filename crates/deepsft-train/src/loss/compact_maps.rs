//! The loss of training step 1 for the compact network: registration and depth of the main block and of the refined maps,
//! the mask, and the bins.

use crate::data::BatchTensors;
use burn::tensor::{Tensor, activation};
use deepsft_network::{NetworkOutput, cross_entropy};

/// Weights of the terms: the refined registration and depth, the main block's own (the paper's 1/2), the bins of all coordinates
/// together, the mask.
const REFINED: f64 = 4.0;
const MAIN: f64 = 2.0;
const BINS: f64 = 0.25;
const MASK: f64 = 1.5;
/// Error up to which the smooth L1 loss is quadratic, in units of the unit square.
const BETA: f64 = 0.01;

/// The loss of `output` against `batch`, [1]: the weighted sum of the smooth L1 of the refined coordinates and of the main
/// block's, the cross-entropy of the bins, summed over the coordinates, and the binary cross-entropy of the mask.
pub fn step_one_loss(output: NetworkOutput, batch: &BatchTensors) -> Tensor<1> {
    let coordinates = |predicted: Tensor<4>| {
        let error = smooth_l1(predicted - batch.cells.clone(), BETA).sum_dim(1);
        (error * batch.cell_weight.clone()).sum() / (batch.cell_weight.clone().sum() + 1.0)
    };
    let refined = coordinates(output.refined);
    let main = coordinates(output.main);
    let bins = output.bins.into_iter().zip(&batch.bin_targets);
    let entropies = bins.map(|(logits, targets)| cross_entropy(logits, targets.clone(), batch.bin_weight.clone()));
    let mask = binary_cross_entropy(output.mask, batch.mask.clone());
    entropies.fold(refined * REFINED + main * MAIN + mask * MASK, |loss, entropy| {
        loss + entropy * BINS
    })
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
