//! R50F: the method that the paper compares itself with first (section 5.3): a ResNet-50 without its last two layers, a
//! dense layer of 200 neurons and one that says depth and registration of every pixel.
//!
//! The last two layers are taken to be the mean over the image and the classifier, so that the dense layer sees where
//! things are. The encoder is ResNet-50 in the form of Keras (23,587,712 parameters). Where the paper is silent (our
//! choice): ReLU after the first dense layer, pixels as 2 value - 1, depth as normalised depth of
//! [`deepsft_inference::DepthRange`]. There is no refinement.

use super::convolution_layer::Convolution;
use super::description::{Cost, LayerTable};
use super::maps::NetworkMaps;
use super::resampling::max_pool;
use super::resnet::Stack;
use super::weight_init::WeightInit;
use burn::module::{Module, Param};
use burn::nn::Linear;
use burn::tensor::{Tensor, activation::relu};
use deepsft_geometry::{CANONICAL_HEIGHT, CANONICAL_WIDTH};
use deepsft_inference::{NetworkConfig, R50FConfig};

/// A dense layer of drawn weights without biases to begin with.
fn dense(inputs: usize, outputs: usize, init: WeightInit) -> Linear {
    Linear {
        weight: Param::from_tensor(init.glorot([inputs, outputs], inputs, outputs)),
        bias: Some(Param::from_tensor(Tensor::zeros([outputs], init.device))),
    }
}

/// R50F with its weights.
#[derive(Module, Debug)]
pub struct R50FNetwork {
    entry: Convolution,
    encode2: Stack,
    encode3: Stack,
    encode4: Stack,
    encode5: Stack,
    neurons: Linear,
    maps: Linear,
    #[module(skip)]
    pub(crate) config: NetworkConfig,
}

impl R50FNetwork {
    /// A network of `shape` for the images of `config`; drawn weights are by Glorot and Bengio.
    pub(super) fn new(shape: &R50FConfig, config: &NetworkConfig, init: WeightInit) -> Self {
        let width = |full: usize| full / shape.width_divisor;
        let stack = Stack::narrowed(shape.width_divisor, init);
        let neurons = width(shape.neurons);
        Self {
            entry: Convolution::normalised([3, width(64)], 7, 2, init),
            encode2: stack(64, [64, 64, 256], [1, 1], 2),
            encode3: stack(256, [128, 128, 512], [2, 1], 3),
            encode4: stack(512, [256, 256, 1024], [2, 1], 5),
            encode5: stack(1024, [512, 512, R50FConfig::ENCODED_CHANNELS], [2, 1], 2),
            neurons: dense(
                width(R50FConfig::ENCODED_CHANNELS) * R50FConfig::ENCODED_SIZE.0 * R50FConfig::ENCODED_SIZE.1,
                neurons,
                init,
            ),
            maps: dense(neurons, R50FConfig::MAP_VALUES, init),
            config: config.clone(),
        }
    }

    /// See [`super::Network::forward_maps`].
    pub(super) fn forward_maps(&self, images: Tensor<4>) -> NetworkMaps {
        let x = max_pool(relu(self.entry.forward(images * 2.0 - 1.0)), 2, 1); // [N, 64, 68, 120]
        let x = self.encode3.forward(self.encode2.forward(x)); // [N, 512, 34, 60]
        let x = self.encode5.forward(self.encode4.forward(x)); // [N, 2048, 9, 15]
        let n = x.dims()[0];
        let x: Tensor<2> = relu(self.neurons.forward(x.flatten(1, 3)));
        let maps: Tensor<4> = self
            .maps
            .forward(x)
            .reshape([n, R50FConfig::MAPS, CANONICAL_HEIGHT, CANONICAL_WIDTH]);
        let (depth, registration) = (maps.clone().narrow(1, 0, 1), maps.narrow(1, 1, 2));
        NetworkMaps {
            main_depth: depth.clone(),
            main_registration: registration.clone(),
            mask_logits: NetworkMaps::mask_logits_of_depth(depth.clone()),
            depth,
            registration,
        }
    }

    /// See [`super::Network::describe`].
    pub(super) fn describe(&self, table: &mut LayerTable) {
        self.entry.describe("conv1", table);
        table.resize("max pool 3x3 stride 2", 68, 120);
        for (name, stack) in [
            ("enc2", &self.encode2),
            ("enc3", &self.encode3),
            ("enc4", &self.encode4),
            ("enc5", &self.encode5),
        ] {
            stack.describe(name, table);
        }
        let mut add = |layer: &Linear, size: fn(usize) -> [usize; 3]| {
            let [inputs, outputs] = layer.weight.dims();
            table.add("dense", size(outputs), Cost::of(layer, [outputs, inputs, 1, 1], 1, 1));
        };
        add(&self.neurons, |outputs| [outputs, 1, 1]);
        add(&self.maps, |_| [R50FConfig::MAPS, CANONICAL_HEIGHT, CANONICAL_WIDTH]);
    }
}
