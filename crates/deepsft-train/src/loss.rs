//! The losses of the three training steps (paper, section 4).

mod bilinear_warp;
mod compact_maps;
mod depth_refinement;
mod photo_consistency;
mod supervised_maps;
mod total_variation;

pub use bilinear_warp::TexturePyramid;
pub use compact_maps::{LossWeights, Losses, step_one_loss};
pub use depth_refinement::DepthLoss;
pub use photo_consistency::{Light, PhotoConsistencyLoss, Residual};
pub use supervised_maps::{SupervisedLosses, supervised_maps_loss};
pub use total_variation::squared_total_variation;

use burn::tensor::Tensor;

/// What the sums over pixels and images of a refinement loss are divided by.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reduction {
    /// Nothing: the loss as the paper prints it.
    Sum,
    /// The number of pixels that count, so that a learning rate does not hang on the size of batch and object. (The
    /// squared total variation still grows with the object; at the paper's weight that is nothing.)
    Mean,
}

/// The loss of a refinement step and its parts, each [1].
#[derive(Clone, Debug)]
pub struct RefinementLoss {
    /// What is minimised.
    pub total: Tensor<1>,
    /// The part of the data.
    pub data: Tensor<1>,
    /// The weighted total variation.
    pub total_variation: Tensor<1>,
}

impl RefinementLoss {
    /// The sums over the pixels that `counts` [N, 1, H, W], reduced.
    fn reduced(data: Tensor<1>, total_variation: Tensor<1>, counts: Tensor<4>, reduction: Reduction) -> Self {
        let (data, total_variation) = match reduction {
            Reduction::Sum => (data, total_variation),
            Reduction::Mean => {
                let pixels = counts.sum().clamp_min(1.0);
                (data / pixels.clone(), total_variation / pixels)
            }
        };
        Self {
            total: data.clone() + total_variation.clone(),
            data,
            total_variation,
        }
    }
}
