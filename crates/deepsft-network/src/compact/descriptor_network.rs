//! Descriptors of any image: what finds a picture that no network was trained for.

use super::main_block::MainBlock;
use crate::convolution_layer::{Convolution, scaled_relu};
use crate::folding::folded;
use crate::weight_array::weights_of;
use crate::weight_init::WeightInit;
use burn::module::Module;
use burn::tensor::{Device, Tensor};
use deepsft_inference::{CompactConfig, DESCRIPTOR_LENGTH, Weights};

/// Keeps the division by a descriptor's length finite.
const LENGTH_FLOOR: f64 = 1e-12;

/// A network of dense descriptors: the trunk of the compact network with one head. For every cell of 8 x 8 pixels it gives a
/// unit vector that tells what is printed there. It stays about the same under light, tilt, bending, and up to half of 45
/// degrees of roll and a factor of two in scale.
///
/// It is trained once on many prints. The classifier over a template's cells, which a network of its own has learnt, is
/// here the product with the descriptors of the template's picture.
#[derive(Module, Debug)]
pub struct DescriptorNetwork {
    main: MainBlock,
    head: Convolution,
}

impl DescriptorNetwork {
    /// A randomly initialised network with a trunk of the default widths.
    pub fn new(device: &Device) -> Self {
        let config = CompactConfig {
            // Nothing is read off them.
            bins: vec![2; 3],
            ..CompactConfig::default()
        };
        let init = WeightInit::new(device, true, 0.0);
        Self {
            main: MainBlock::new(&config, init),
            head: Convolution::head([config.channels[1], DESCRIPTOR_LENGTH], 1, init),
        }
    }

    /// Computes the unit vectors [N, [`DESCRIPTOR_LENGTH`], H / 8, W / 8] of images [N, 3, H, W]. Values are 0..=1; H and W are
    /// multiples of 16.
    pub fn forward(&self, images: Tensor<4>) -> Tensor<4> {
        let features = self.main.features((images - 0.5) * 4.0).at8;
        let descriptors = self.head.forward(scaled_relu(features));
        let length = (descriptors.clone().square().sum_dim(1) + LENGTH_FLOOR).sqrt();
        descriptors / length
    }

    /// The weights of the finished network by their paths, for those who only run it. They are read from the device at once.
    pub fn folded_weights(&self) -> Weights {
        folded(weights_of(&self.valid()))
    }
}
