//! Layers: weight-standardised convolutions, residual blocks, bilinear up-sampling.

use crate::convolution::{Convolved, convolve};
use crate::description::Cost;
use crate::fold::{Fold, folded};
use burn::module::{Module, Param};
use burn::tensor::{Device, Distribution, Tensor, activation};

/// Makes the second moment of relu(x) that of x for a standard normal x
/// (Brock et al. 2021, "Characterizing signal propagation in normalizer-free networks").
const RELU_GAIN: f32 = 1.713_958_7;

/// Keeps the division by a filter's deviation finite.
pub const VARIANCE_FLOOR: f64 = 1e-6;

/// Initial gain of the last convolution of a residual branch: the block starts near the identity.
pub const BRANCH_GAIN: f32 = 0.25;

/// Standard deviation of the initial weights of a layer that predicts.
const HEAD_DEVIATION: f64 = 0.01;

/// A convolution with bias. In training its filters are standardised (zero mean, variance one over
/// the fan-in, times a learnt gain per filter): what batch normalisation gives a small network, at the
/// cost of a pass over the weights instead of passes over the activations, and nothing depends on
/// the batch. [`Fold`] bakes it into plain weights for inference.
#[derive(Module, Debug)]
pub struct Convolution {
    /// Raw filters, [out, in, k, k].
    weight: Param<Tensor<4>>,
    /// Gain per filter, [out]; absent in a plain or folded convolution.
    gain: Option<Param<Tensor<1>>>,
    /// Bias, [out].
    bias: Param<Tensor<1>>,
    stride: usize,
}

impl Convolution {
    /// A standardised `kernel` x `kernel` convolution; padding keeps ceil(size / stride).
    pub fn standardised(channels: [usize; 2], kernel: usize, stride: usize, gain: f32, device: &Device) -> Self {
        let [inputs, outputs] = channels;
        let deviation = 1.0 / ((inputs * kernel * kernel) as f64).sqrt();
        let mut layer = Self::plain(channels, kernel, stride, deviation, device);
        layer.gain = Some(Param::from_tensor(Tensor::full([outputs], gain, device)));
        layer
    }

    /// A convolution without standardisation, for the layers that predict.
    pub fn head(channels: [usize; 2], kernel: usize, device: &Device) -> Self {
        Self::plain(channels, kernel, 1, HEAD_DEVIATION, device)
    }

    fn plain([inputs, outputs]: [usize; 2], kernel: usize, stride: usize, deviation: f64, device: &Device) -> Self {
        let weight = Tensor::random(
            [outputs, inputs, kernel, kernel],
            Distribution::Normal(0.0, deviation),
            device,
        );
        Self {
            weight: Param::from_tensor(weight),
            gain: None,
            bias: Param::from_tensor(Tensor::zeros([outputs], device)),
            stride,
        }
    }

    /// The filters that are applied, [out, in, k, k].
    fn effective_weight(&self) -> Tensor<4> {
        let weight = self.weight.val();
        let Some(gain) = &self.gain else { return weight };
        let [outputs, inputs, height, width] = weight.dims();
        let fan_in = inputs * height * width;
        // [out, in * k * k]
        let flat: Tensor<2> = weight.reshape([outputs, fan_in]);
        let centred = flat.clone() - flat.mean_dim(1);
        let variance = centred.clone().square().mean_dim(1);
        let scale = (variance * fan_in as f64 + VARIANCE_FLOOR).sqrt().recip();
        let gain: Tensor<2> = gain.val().reshape([outputs, 1]);
        (centred * (scale * gain)).reshape([outputs, inputs, height, width])
    }

    /// [N, in, H, W] -> [N, out, ceil(H / stride), ceil(W / stride)].
    pub fn forward(&self, x: Tensor<4>) -> Tensor<4> {
        self.convolve(x, None)
    }

    /// The same of [`scaled_relu`] of `x`.
    pub fn forward_rectified(&self, x: Tensor<4>) -> Tensor<4> {
        self.convolve(x, Some(RELU_GAIN))
    }

    fn convolve(&self, x: Tensor<4>, rectified: Option<f32>) -> Tensor<4> {
        let weight = self.effective_weight();
        let bias = self.bias.val();
        let stride = self.stride;
        convolve(x, weight, bias, Convolved { stride, rectified })
    }

    /// What it costs on a map whose output has `pixels` pixels.
    pub fn cost(&self, pixels: usize) -> Cost {
        Cost::of(self, self.weight.dims(), pixels, 1)
    }

    /// Channels of what comes out.
    pub fn channels(&self) -> usize {
        self.weight.dims()[0]
    }
}

impl Fold for Convolution {
    fn fold(self) -> Self {
        let weight = Param::from_tensor(self.effective_weight().detach());
        Self {
            weight,
            gain: None,
            ..self
        }
    }
}

/// relu with the gain that keeps the signal's second moment.
pub fn scaled_relu(x: Tensor<4>) -> Tensor<4> {
    activation::relu(x) * RELU_GAIN
}

/// x + conv(relu(conv(relu(x)))), 3x3, same width: the identity block of a residual network.
#[derive(Module, Debug)]
pub struct ResidualBlock {
    first: Convolution,
    second: Convolution,
}

impl ResidualBlock {
    /// A block of `channels` channels.
    pub fn new(channels: usize, device: &Device) -> Self {
        Self {
            first: Convolution::standardised([channels, channels], 3, 1, 1.0, device),
            second: Convolution::standardised([channels, channels], 3, 1, BRANCH_GAIN, device),
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
            .map(|layer| layer.cost(pixels))
            .into_iter()
            .sum()
    }
}

impl Fold for ResidualBlock {
    fn fold(self) -> Self {
        folded!(self, [first, second], [])
    }
}

/// Bilinear up-sampling by an integer factor, cells' centres kept, edges repeated:
/// [N, C, h, w] -> [N, C, factor h, factor w]. Two matrix products, the same on every device.
pub fn upsample_bilinear(x: Tensor<4>, factor: usize) -> Tensor<4> {
    let [_, _, h, w] = x.dims();
    let device = x.device();
    // [1, 1, factor h, h] x [N, C, h, w] x [1, 1, w, factor w]
    let rows = interpolation_matrix(h, factor, &device);
    let columns = interpolation_matrix(w, factor, &device).swap_dims(2, 3);
    rows.matmul(x).matmul(columns)
}

/// Row i holds the linear weights of sample i of a signal up-sampled `factor` times,
/// [1, 1, factor * length, length].
fn interpolation_matrix(length: usize, factor: usize, device: &Device) -> Tensor<4> {
    let fine = factor * length;
    let mut weights = vec![0.0_f32; fine * length];
    for i in 0..fine {
        let at = ((i as f32 + 0.5) / factor as f32 - 0.5).clamp(0.0, (length - 1) as f32);
        let low = at as usize;
        let fraction = at - low as f32;
        weights[i * length + low] += 1.0 - fraction;
        weights[i * length + (low + 1).min(length - 1)] += fraction;
    }
    Tensor::<1>::from_floats(weights.as_slice(), device).reshape([1, 1, fine, length])
}

/// Space to depth: [N, C, H, W] -> [N, C * block^2, H / block, W / block], channel order
/// (c, row in the block, column in the block).
pub fn space_to_depth(x: Tensor<4>, block: usize) -> Tensor<4> {
    let [n, c, h, w] = x.dims();
    let (rows, columns) = (h / block, w / block);
    let split: Tensor<6> = x.reshape([n, c, rows, block, columns, block]);
    split
        .permute([0, 1, 3, 5, 2, 4])
        .reshape([n, c * block * block, rows, columns])
}

/// Depth to space, the inverse of [`space_to_depth`]:
/// [N, C * block^2, h, w] -> [N, C, h * block, w * block].
pub fn depth_to_space(x: Tensor<4>, block: usize) -> Tensor<4> {
    let [n, c, h, w] = x.dims();
    let channels = c / (block * block);
    let split: Tensor<6> = x.reshape([n, channels, block, block, h, w]);
    split
        .permute([0, 1, 4, 2, 5, 3])
        .reshape([n, channels, h * block, w * block])
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ramp(shape: [usize; 4]) -> Tensor<4> {
        let count: usize = shape.iter().product();
        let values: Vec<f32> = (0..count).map(|i| i as f32).collect();
        Tensor::<1>::from_floats(values.as_slice(), &Device::flex()).reshape(shape)
    }

    #[test]
    fn folding_keeps_the_function() {
        let device = Device::flex();
        for kernel in [1, 3] {
            let layer = Convolution::standardised([5, 7], kernel, 1, 0.7, &device);
            let x = Tensor::random([2, 5, 6, 4], Distribution::Normal(0.3, 1.0), &device);
            let before = layer.forward(x.clone());
            let after = layer.fold().forward(x);
            assert!((before - after).abs().max().into_scalar::<f32>() < 1e-5);
        }
    }

    #[test]
    fn a_standardised_filter_keeps_the_variance_of_white_noise() {
        let device = Device::flex();
        let layer = Convolution::standardised([16, 64], 3, 1, 1.0, &device);
        let x = Tensor::random([1, 16, 40, 40], Distribution::Normal(0.0, 1.0), &device);
        let y = layer.forward(x).slice([0..1, 0..64, 1..39, 1..39]);
        let variance = y.square().mean().into_scalar::<f32>();
        // 92,416 correlated samples: within a few per cent of 1.
        assert!((variance - 1.0).abs() < 0.1, "{variance}");
    }

    #[test]
    fn space_to_depth_and_back_is_the_identity() {
        let x = ramp([2, 3, 8, 12]);
        let back = depth_to_space(space_to_depth(x.clone(), 4), 4);
        assert_eq!(x.into_data(), back.into_data());
    }

    #[test]
    fn bilinear_upsampling_reproduces_a_ramp_between_centres() {
        // Cells hold 0, 1, 2, 3; by 2 the inner samples lie a quarter cell off: 0.25, 0.75, 1.25, ...
        let y = upsample_bilinear(ramp([1, 1, 1, 4]), 2)
            .into_data()
            .try_to_vec::<f32>()
            .unwrap();
        let row = [0.0, 0.25, 0.75, 1.25, 1.75, 2.25, 2.75, 3.0];
        assert_eq!(y, [row, row].concat());
    }
}
