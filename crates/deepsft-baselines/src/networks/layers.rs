//! Layers that several networks have.

use burn::nn::conv::{Conv2d, Conv2dConfig};
use burn::nn::{BatchNorm, BatchNormConfig, PaddingConfig2d};
use burn::tensor::module::interpolate;
use burn::tensor::ops::{InterpolateMode, InterpolateOptions};
use burn::tensor::{Device, Tensor, activation::relu};

/// A share of a full width, at least one channel.
pub fn narrowed(width: usize, divisor: usize) -> usize {
    (width / divisor).max(1)
}

/// A `kernel` x `kernel` convolution, padded so that ceil(size / stride) stays; `channels` are in and out.
pub fn convolution(channels: [usize; 2], kernel: usize) -> Conv2dConfig {
    let p = kernel / 2;
    Conv2dConfig::new(channels, [kernel; 2]).with_padding(PaddingConfig2d::Explicit(p, p, p, p))
}

/// The same without bias, with new weights.
pub fn unbiased(channels: [usize; 2], kernel: usize, device: &Device) -> Conv2d {
    convolution(channels, kernel).with_bias(false).init(device)
}

/// A 3 x 3 convolution of cells that are `dilation` apart.
pub fn dilated(channels: [usize; 2], dilation: usize) -> Conv2dConfig {
    let padding = PaddingConfig2d::Explicit(dilation, dilation, dilation, dilation);
    Conv2dConfig::new(channels, [3; 2])
        .with_dilation([dilation; 2])
        .with_padding(padding)
}

/// Batch normalisation of so many channels.
pub fn normalisation(channels: usize, device: &Device) -> BatchNorm {
    BatchNormConfig::new(channels).init(device)
}

/// A convolution, batch normalisation and ReLU.
#[derive(burn::module::Module, Debug)]
pub struct Normalised {
    convolution: Conv2d,
    normalisation: BatchNorm,
}

impl Normalised {
    /// The layer of this convolution, which loses its bias.
    pub fn new(convolution: Conv2dConfig, device: &Device) -> Self {
        Self {
            normalisation: normalisation(convolution.channels[1], device),
            convolution: convolution.with_bias(false).init(device),
        }
    }

    /// Without the ReLU.
    pub fn linear(&self, x: Tensor<4>) -> Tensor<4> {
        self.normalisation.forward(self.convolution.forward(x))
    }

    /// [N, in, H, W] -> [N, out, H, W] over the stride.
    pub fn forward(&self, x: Tensor<4>) -> Tensor<4> {
        relu(self.linear(x))
    }
}

/// The same maps of another size, bilinear.
pub fn resized(x: Tensor<4>, size: [usize; 2]) -> Tensor<4> {
    let options = InterpolateOptions::new(InterpolateMode::Bilinear).with_align_corners(false);
    interpolate(x, options.with_output_size(size))
}

/// Every pixel `factor` x `factor` times.
pub fn repeated(x: Tensor<4>, factor: usize) -> Tensor<4> {
    let [n, c, h, w] = x.dims();
    let spread: Tensor<6> = x.reshape([n, c, h, 1, w, 1]).expand([n, c, h, factor, w, factor]);
    spread.reshape([n, c, factor * h, factor * w])
}

/// Every `step`-th pixel.
pub fn thinned(x: Tensor<4>, step: usize) -> Tensor<4> {
    let [n, c, h, w] = x.dims();
    let cells: Tensor<6> = x.reshape([n, c, h / step, step, w / step, step]);
    cells
        .slice([0..n, 0..c, 0..h / step, 0..1, 0..w / step, 0..1])
        .reshape([n, c, h / step, w / step])
}
