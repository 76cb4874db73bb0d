//! DenseNet without its classifier: the encoder of DenseDepth and BTS.
//!
//! G. Huang, Z. Liu, L. van der Maaten, K. Q. Weinberger, *Densely Connected Convolutional Networks*, CVPR 2017. Layers as in the authors'
//! code: normalisation, ReLU, convolution.

use super::layers::{Normalised, convolution, narrowed, normalisation, unbiased};
use burn::module::Module;
use burn::nn::BatchNorm;
use burn::nn::conv::Conv2d;
use burn::tensor::module::{avg_pool2d, max_pool2d};
use burn::tensor::ops::{AvgPoolOptions, MaxPoolOptions};
use burn::tensor::{Device, Tensor, activation::relu};

/// Channels of the bottleneck of a layer, in growths.
const BOTTLENECK: usize = 4;

#[derive(Module, Debug)]
struct DenseLayer {
    normalisation: BatchNorm,
    narrow: Normalised,
    convolution: Conv2d,
}

impl DenseLayer {
    fn forward(&self, x: Tensor<4>) -> Tensor<4> {
        let new = self.narrow.forward(relu(self.normalisation.forward(x.clone())));
        Tensor::cat(vec![x, self.convolution.forward(new)], 1)
    }
}

#[derive(Module, Debug)]
struct Transition {
    normalisation: BatchNorm,
    convolution: Conv2d,
}

impl Transition {
    fn forward(&self, x: Tensor<4>) -> Tensor<4> {
        let x = self.convolution.forward(relu(self.normalisation.forward(x)));
        avg_pool2d(x, AvgPoolOptions::new([2, 2]))
    }
}

/// The encoder with its weights.
#[derive(Module, Debug)]
pub struct DenseNet {
    entry: Normalised,
    blocks: Vec<Vec<DenseLayer>>,
    transitions: Vec<Transition>,
    last: BatchNorm,
}

impl DenseNet {
    /// The encoder of `growth` over `divisor` new channels a layer, `first` over it in the beginning, and so many layers a block; and the
    /// channels of what [`DenseNet::forward`] gives.
    pub fn new(growth: usize, first: usize, layers: [usize; 4], divisor: usize, device: &Device) -> (Self, [usize; 5]) {
        let (growth, first) = (narrowed(growth, divisor), narrowed(first, divisor));
        let mut channels = first;
        let (mut blocks, mut transitions, mut given) = (Vec::new(), Vec::new(), vec![first, first]);
        for (number, &count) in layers.iter().enumerate() {
            let layer = |k: usize| {
                let inputs = channels + k * growth;
                DenseLayer {
                    normalisation: normalisation(inputs, device),
                    narrow: Normalised::new(convolution([inputs, BOTTLENECK * growth], 1), device),
                    convolution: unbiased([BOTTLENECK * growth, growth], 3, device),
                }
            };
            blocks.push((0..count).map(layer).collect());
            channels += count * growth;
            if number + 1 < layers.len() {
                transitions.push(Transition {
                    normalisation: normalisation(channels, device),
                    convolution: unbiased([channels, channels / 2], 1, device),
                });
                channels /= 2;
                given.push(channels);
            }
        }
        let encoder = Self {
            entry: Normalised::new(convolution([3, first], 7).with_stride([2, 2]), device),
            blocks,
            transitions,
            last: normalisation(channels, device),
        };
        (encoder, [given[0], given[1], given[2], given[3], channels])
    }

    /// [N, 3, H, W], multiples of 32 -> maps of 1/2 (entry), 1/4 (pooled), 1/8 and 1/16 (first two transitions) and 1/32 (the end, after ReLU) of the size.
    pub fn forward(&self, images: Tensor<4>) -> [Tensor<4>; 5] {
        let half = self.entry.forward(images);
        let pooling = MaxPoolOptions::new([3, 3]).with_stride([2, 2]).with_padding([1, 1]);
        let quarter = max_pool2d(half.clone(), pooling);
        let dense = |x: Tensor<4>, k: usize| self.blocks[k].iter().fold(x, |x, layer| layer.forward(x));
        let step = |x: &Tensor<4>, k: usize| self.transitions[k].forward(dense(x.clone(), k));
        let eighth = step(&quarter, 0);
        let sixteenth = step(&eighth, 1);
        let end = relu(self.last.forward(dense(step(&sixteenth, 2), 3)));
        [half, quarter, eighth, sixteenth, end]
    }
}
