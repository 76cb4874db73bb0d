//! The residual block of the compact network.

use crate::convolution_layer::Convolution;
use crate::description::Cost;
use crate::weight_init::WeightInit;
use burn::module::Module;
use burn::tensor::Tensor;

/// Initial gain of the last convolution of a residual branch: the block starts near the identity.
pub const BRANCH_GAIN: f32 = 0.25;

/// x + conv(relu(conv(relu(x)))), 3x3, same width: the identity block of a residual network.
#[derive(Module, Debug)]
pub struct ResidualBlock {
    first: Convolution,
    second: Convolution,
}

impl ResidualBlock {
    /// A block of `channels` channels.
    pub fn new(channels: usize, init: WeightInit) -> Self {
        Self {
            first: Convolution::standardised([channels, channels], 3, 1, 1.0, init),
            second: Convolution::standardised([channels, channels], 3, 1, BRANCH_GAIN, init),
        }
    }

    /// [N, C, H, W] -> [N, C, H, W].
    pub fn forward(&self, x: Tensor<4>) -> Tensor<4> {
        let branch = self.first.forward_rectified(x.clone());
        x + self.second.forward_rectified(branch)
    }

    /// What it costs on a map of `pixels` pixels.
    pub fn cost(&self, pixels: usize) -> Cost {
        [&self.first, &self.second]
            .map(|layer| layer.cost(pixels, 1))
            .into_iter()
            .sum()
    }
}
