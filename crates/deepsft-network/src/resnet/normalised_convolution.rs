//! A convolution followed by batch normalisation.

use super::weight_init::WeightInit;
use crate::convolution::{Convolved, convolve};
use crate::description::{Cost, LayerTable};
use crate::fold::Fold;
use burn::module::{Module, Param};
use burn::nn::{BatchNorm, BatchNormConfig};
use burn::tensor::Tensor;

/// Added to the variance, as in Keras (the paper's framework).
pub const EPSILON: f64 = 1e-3;

/// A convolution with bias and, while it is trained, batch normalisation. [`Fold`] bakes the running
/// statistics into the filters for inference. A layer that predicts has none from the start.
#[derive(Module, Debug)]
pub struct NormalisedConvolution {
    /// Filters, [out, in, k, k].
    weight: Param<Tensor<4>>,
    /// Bias, [out].
    bias: Param<Tensor<1>>,
    normalisation: Option<BatchNorm>,
    stride: usize,
}

impl NormalisedConvolution {
    /// A `kernel` x `kernel` convolution with batch normalisation; `channels` are in and out. Padding keeps
    /// ceil(size / stride).
    pub fn new(channels: [usize; 2], kernel: usize, stride: usize, init: WeightInit) -> Self {
        let mut layer = Self::plain(channels, kernel, init);
        layer.stride = stride;
        layer.normalisation = init.drawn.then(|| {
            BatchNormConfig::new(channels[1])
                .with_epsilon(EPSILON)
                .with_momentum(init.momentum)
                .init(init.device)
        });
        layer
    }

    /// A convolution of stride 1 without batch normalisation.
    pub fn plain([inputs, outputs]: [usize; 2], kernel: usize, init: WeightInit) -> Self {
        let area = kernel * kernel;
        Self {
            weight: Param::from_tensor(init.glorot([outputs, inputs, kernel, kernel], area * inputs, area * outputs)),
            bias: Param::from_tensor(Tensor::zeros([outputs], init.device)),
            normalisation: None,
            stride: 1,
        }
    }

    /// [N, in, H, W] -> [N, out, ceil(H / stride), ceil(W / stride)].
    pub fn forward(&self, x: Tensor<4>) -> Tensor<4> {
        let y = self.convolve(x);
        match &self.normalisation {
            Some(normalisation) => normalisation.forward(y),
            None => y,
        }
    }

    fn convolve(&self, x: Tensor<4>) -> Tensor<4> {
        let (weight, bias) = (self.weight.val(), self.bias.val());
        let stride = self.stride;
        let rectified = None;
        convolve(x, weight, bias, Convolved { stride, rectified })
    }

    /// Filters: channels of what comes out.
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
        let [_, rows, columns] = table.size();
        let (rows, columns) = (rows.div_ceil(self.stride), columns.div_ceil(self.stride));
        let output = [self.weight.dims()[0], rows, columns];
        table.add(format!("{name} {}", self.kind()), output, self.cost(rows * columns, 1));
    }

    /// What it costs to say `pixels` pixels, of which 1 / `saving` are worked out.
    pub fn cost(&self, pixels: usize, saving: usize) -> Cost {
        Cost::of(self, self.weight.dims(), pixels, saving)
    }
}

impl Fold for NormalisedConvolution {
    /// With the running statistics in filters and bias: gamma (w x + b - mean) / sqrt(variance + epsilon) + beta is a
    /// convolution again.
    fn fold(self) -> Self {
        let Some(normalisation) = self.normalisation else {
            return self;
        };
        let mean = normalisation.running_mean.value_sync();
        let variance = normalisation.running_var.value_sync();
        let scale = normalisation.gamma.val() / (variance + normalisation.epsilon).sqrt(); // [out]
        let bias = (self.bias.val() - mean) * scale.clone() + normalisation.beta.val();
        let channels = scale.dims()[0];
        let weight = self.weight.val() * scale.reshape([channels, 1, 1, 1]);
        Self {
            weight: Param::from_tensor(weight.detach()),
            bias: Param::from_tensor(bias.detach()),
            normalisation: None,
            stride: self.stride,
        }
    }
}
