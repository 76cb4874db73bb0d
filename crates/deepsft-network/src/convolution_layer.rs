//! The layer of all networks: a convolution, standardised or normalised while it is trained.

use crate::convolution::{Convolved, convolve};
use crate::description::{Cost, LayerTable};
use crate::weight_init::WeightInit;
use burn::module::{Module, Param};
use burn::nn::{BatchNorm, BatchNormConfig};
use burn::tensor::{Tensor, activation};

/// Makes the second moment of relu(x) that of x for a standard normal x
/// (Brock et al. 2021, "Characterizing signal propagation in normalizer-free networks").
const RELU_GAIN: f32 = 1.713_958_7;

/// Keeps the division by a filter's deviation finite.
pub const VARIANCE_FLOOR: f64 = 1e-6;

/// Added to the variance of batch normalisation, as in Keras (the paper's framework).
pub const NORMALISATION_EPSILON: f64 = 1e-3;

/// Standard deviation of the initial weights of a layer that predicts.
const HEAD_DEVIATION: f64 = 0.01;

/// A convolution with bias. A folded one has nothing else ([`super::Network::fold`]).
///
/// In training the filters of the compact network are standardised (zero mean, variance one over the fan-in, times a learnt gain per
/// filter): what batch normalisation gives a small network, at the cost of a pass over the weights instead of passes over the
/// activations, and nothing depends on the batch. The paper's network and R50F have batch normalisation. Layers that predict have
/// neither.
#[derive(Module, Debug)]
pub struct Convolution {
    /// Raw filters, [out, in, k, k].
    weight: Param<Tensor<4>>,
    /// Gain per filter, [out].
    gain: Option<Param<Tensor<1>>>,
    /// Bias, [out].
    bias: Param<Tensor<1>>,
    normalisation: Option<BatchNorm>,
    stride: usize,
}

impl Convolution {
    /// A standardised `kernel` x `kernel` convolution; `channels` are in and out. Padding keeps ceil(size / stride).
    pub fn standardised(channels: [usize; 2], kernel: usize, stride: usize, gain: f32, init: WeightInit) -> Self {
        let fan_in = channels[0] * kernel * kernel;
        let mut layer = Self::new(channels, kernel, init, |shape| {
            init.normal(shape, 1.0 / (fan_in as f64).sqrt())
        });
        let gains = || Param::from_tensor(Tensor::full([channels[1]], gain, init.device));
        (layer.stride, layer.gain) = (stride, init.drawn.then(gains));
        layer
    }

    /// A convolution of the compact network that predicts.
    pub fn head(channels: [usize; 2], kernel: usize, init: WeightInit) -> Self {
        Self::new(channels, kernel, init, |shape| init.normal(shape, HEAD_DEVIATION))
    }

    /// A convolution with batch normalisation; `channels` are in and out. Padding keeps ceil(size / stride).
    pub fn normalised(channels: [usize; 2], kernel: usize, stride: usize, init: WeightInit) -> Self {
        let mut layer = Self::plain(channels, kernel, init);
        layer.stride = stride;
        layer.normalisation = init.drawn.then(|| {
            BatchNormConfig::new(channels[1])
                .with_epsilon(NORMALISATION_EPSILON)
                .with_momentum(init.momentum)
                .init(init.device)
        });
        layer
    }

    /// The same of stride 1 without batch normalisation.
    pub fn plain(channels: [usize; 2], kernel: usize, init: WeightInit) -> Self {
        let [fan_in, fan_out] = channels.map(|count| kernel * kernel * count);
        Self::new(channels, kernel, init, |shape| init.glorot(shape, fan_in, fan_out))
    }

    fn new(
        [inputs, outputs]: [usize; 2],
        kernel: usize,
        init: WeightInit,
        weight: impl FnOnce([usize; 4]) -> Tensor<4>,
    ) -> Self {
        Self {
            weight: Param::from_tensor(weight([outputs, inputs, kernel, kernel])),
            gain: None,
            bias: Param::from_tensor(Tensor::zeros([outputs], init.device)),
            normalisation: None,
            stride: 1,
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
        let stride = self.stride;
        let y = convolve(
            x,
            self.effective_weight(),
            self.bias.val(),
            Convolved { stride, rectified },
        );
        match &self.normalisation {
            Some(normalisation) => normalisation.forward(y),
            None => y,
        }
    }

    /// What it costs to say `pixels` pixels, of which 1 / `saving` are worked out.
    pub fn cost(&self, pixels: usize, saving: usize) -> Cost {
        Cost::of(self, self.weight.dims(), pixels, saving)
    }

    /// Channels of what comes out.
    pub fn channels(&self) -> usize {
        self.weight.dims()[0]
    }

    /// Stride.
    pub fn stride(&self) -> usize {
        self.stride
    }

    /// Filters as a table names them: "7x7 stride 2".
    fn kind(&self) -> String {
        let kernel = self.weight.dims()[2];
        match self.stride {
            1 => format!("{kernel}x{kernel}"),
            stride => format!("{kernel}x{kernel} stride {stride}"),
        }
    }

    /// Writes itself into `table` under `name`.
    pub fn describe(&self, name: &str, table: &mut LayerTable) {
        let [_, rows, columns] = table.size;
        let (rows, columns) = (rows.div_ceil(self.stride), columns.div_ceil(self.stride));
        let output = [self.channels(), rows, columns];
        table.add(format!("{name} {}", self.kind()), output, self.cost(rows * columns, 1));
    }
}

/// relu with the gain that keeps the signal's second moment.
pub fn scaled_relu(x: Tensor<4>) -> Tensor<4> {
    activation::relu(x) * RELU_GAIN
}

#[cfg(test)]
mod tests {
    use super::*;
    use burn::tensor::{Device, Distribution};

    #[test]
    fn a_standardised_filter_keeps_the_variance_of_white_noise() {
        let device = Device::flex();
        let layer = Convolution::standardised([16, 64], 3, 1, 1.0, WeightInit::new(&device, true, 0.0));
        let x = Tensor::random([1, 16, 40, 40], Distribution::Normal(0.0, 1.0), &device);
        let y = layer.forward(x).slice([0..1, 0..64, 1..39, 1..39]);
        let variance = y.square().mean().into_scalar::<f32>();
        // 92,416 correlated samples: within a few per cent of 1.
        assert!((variance - 1.0).abs() < 0.1, "{variance}");
    }
}
