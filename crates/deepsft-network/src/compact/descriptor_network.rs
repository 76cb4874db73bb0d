//! Descriptors of any image: what finds a picture that no network was trained for.

use super::layers::{Convolution, scaled_relu};
use super::main_block::MainBlock;
use crate::error::NetworkError;
use crate::fold::Fold;
use crate::half_precision::Half;
use crate::weight_array::weights_of;
use burn::module::Module;
use burn::store::ModuleRecord;
use burn::tensor::{Bytes, Device, Tensor};
use deepsft_inference::{CompactConfig, DESCRIPTOR_LENGTH, Weights};

/// Keeps the division by a descriptor's length finite.
const LENGTH_FLOOR: f64 = 1e-12;

/// The trunk of the compact network with one head: for every cell of 8 x 8 pixels a unit vector that tells what is printed
/// there, about the same under light, tilt, bending, and up to half of 45 degrees of roll and a factor of two in scale.
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
            bins: [2; 3],
            ..CompactConfig::default()
        };
        Self {
            main: MainBlock::new(&config, device),
            head: Convolution::head([config.channels[1], DESCRIPTOR_LENGTH], 1, device),
        }
    }

    /// Images [N, 3, H, W], values 0..=1, H and W multiples of 16 -> unit vectors [N, [`DESCRIPTOR_LENGTH`], H / 8, W / 8].
    pub fn forward(&self, images: Tensor<4>) -> Tensor<4> {
        let features = self.main.features((images - 0.5) * 4.0).at8;
        let descriptors = self.head.forward(scaled_relu(features));
        let length = (descriptors.clone().square().sum_dim(1) + LENGTH_FLOOR).sqrt();
        descriptors / length
    }

    /// The same function for inference: weight standardisation is baked into the convolutions.
    pub fn fold(self) -> Self {
        Self {
            main: self.main.fold(),
            head: self.head,
        }
    }

    /// All weights by their paths. They are read from the device at once.
    pub fn weights(&self) -> Weights {
        weights_of(self)
    }

    /// Reads the weights that [`DescriptorNetwork::to_bytes`] wrote.
    ///
    /// # Errors
    /// [`NetworkError::Weights`] for bytes that are no weights of this network.
    pub fn from_bytes(bytes: &[u8], device: &Device) -> Result<Self, NetworkError> {
        let refused = |reason: String| NetworkError::Weights {
            file: "the weights of the descriptor network".to_owned(),
            reason,
        };
        crate::weight_array::check_weights(bytes).map_err(refused)?;
        let bytes = Bytes::from_bytes_vec(bytes.to_vec());
        let record = ModuleRecord::from_bytes(bytes).map_err(|e| refused(e.to_string()))?;
        let empty = Self::new(&Device::flex()).fold();
        let network = empty
            .try_load_record(record.cast_to_module_dtype())
            .map_err(|e| refused(e.to_string()))?;
        Ok(network.fork(device))
    }

    /// The weights, folded, as a burnpack file in half precision.
    ///
    /// # Errors
    /// [`NetworkError::Weights`] when they cannot be encoded.
    pub fn to_bytes(&self) -> Result<Vec<u8>, NetworkError> {
        let half = self.valid().fold().fork(&Device::flex()).map(&mut Half);
        let bytes = half.into_record().into_bytes();
        let bytes = bytes.map_err(|e| NetworkError::Weights {
            file: "the weights of the descriptor network".to_owned(),
            reason: e.to_string(),
        })?;
        Ok(bytes.to_vec())
    }
}
