//! The losses of the three training steps (paper, section 4).

mod bilinear_warp;
mod compact_maps;
mod depth_refinement;
mod photo_consistency;
mod rest_registration;
mod supervised_maps;
mod total_variation;

#[cfg(test)]
#[path = "../tests/loss/mod.rs"]
mod tests;

pub use depth_refinement::DepthLoss;
pub use photo_consistency::{Light, PhotoConsistencyLoss, Residual};

pub(crate) use bilinear_warp::TexturePyramid;
pub(crate) use compact_maps::step_one_loss;
pub(crate) use rest_registration::registration_of_positions;
pub(crate) use supervised_maps::supervised_maps_loss;
#[cfg(test)]
use total_variation::squared_total_variation;

use burn::tensor::Tensor;

/// The loss, [1], of the sums over the pixels that `counts` [N, 1, H, W], of the `data` and the weighted `total_variation`:
/// divided by the number of these pixels, so that a learning rate does not depend on the size of batch and object. (The
/// squared total variation still grows with the object; at the paper's weight that is nothing.)
fn mean_over(counts: Tensor<4>, data: Tensor<1>, total_variation: Tensor<1>) -> Tensor<1> {
    let pixels = counts.sum().clamp_min(1.0);
    data / pixels.clone() + total_variation / pixels
}
