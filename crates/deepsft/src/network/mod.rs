//! Networks: image in, depth and registration maps out.
//!
//! [`NetworkConfig`] says which architecture and how large, [`Network`] is any of them with its weights,
//! [`Network::forward_maps`] what training steps and tools need of it: the same maps from each.

mod block;
mod compact;
mod config;
mod description;
mod half_precision;
mod layer_table;
mod maps;
mod module;
mod paper;
mod r50f;
mod reading;
mod resnet;
mod upsampling;
mod weight_array;

pub use block::Block;
pub use compact::{
    CompactConfig, CompactNetwork, INPUT_MULTIPLE, NetworkOutput, PIXELS_PER_CELL, SEAM_JUMP, cross_entropy,
};
pub use config::{Architecture, DepthRange, NetworkConfig};
pub use description::LayerDescription;
pub use layer_table::layer_table;
pub use maps::{NetworkMaps, OUTSIDE};
pub use paper::{PaperConfig, PaperNetwork};
pub use r50f::{R50FConfig, R50FNetwork};
pub use reading::{Stage, images_to_tensor, pictures_to_tensor};
pub use weight_array::WeightArray;

use burn::tensor::Tensor;

/// A network of any architecture with its weights.
///
/// It is a burn module whose weights have the paths they have in their architecture
/// (`main.encode8.first.weight`), whichever variant holds them: a record of a compact network made before there
/// were others loads unchanged.
///
/// Clones share the running statistics of batch normalisation (burn's `RunningState`), and loading a record into
/// one changes the other's: make a second network of a [`NetworkConfig`] instead of cloning one to load into.
#[derive(Clone, Debug)]
#[allow(clippy::large_enum_variant)] // There is one network, not an array of them.
#[non_exhaustive]
pub enum Network {
    /// The compact network.
    Compact(CompactNetwork),
    /// The paper's network.
    Paper(PaperNetwork),
    /// A ResNet-50 with dense layers.
    R50F(R50FNetwork),
}

impl Network {
    /// How the network was built.
    pub fn config(&self) -> &NetworkConfig {
        match self {
            Self::Compact(network) => network.config(),
            Self::Paper(network) => network.config(),
            Self::R50F(network) => network.config(),
        }
    }

    /// The compact network, if it is one: only that has cells, bins and windows of frames.
    pub fn as_compact(&self) -> Option<&CompactNetwork> {
        match self {
            Self::Compact(network) => Some(network),
            _ => None,
        }
    }

    /// Maps of images [B, 3, H, W] of the training camera, values 0..=1, differentiable with respect to all weights
    /// that are trained (see [`Network::train_only`]). The compact network takes any size; the paper's network and
    /// R50F take 270 x 480 only (H x W).
    ///
    /// On a device with differentiation batch normalisation that is trained uses the statistics of the batch and
    /// updates its running ones; frozen, validating ([`burn::module::Module::valid`]) or folded it uses the latter.
    ///
    /// The layers compute in the precision of `images`: images cast to half precision make a forward and backward pass
    /// in mixed precision, with weights, batch normalisation, maps and gradients in single precision.
    ///
    /// # Panics
    /// Like all of burn's operations when the shape is another one.
    pub fn forward_maps(&self, images: Tensor<4>) -> NetworkMaps {
        match self {
            Self::Compact(network) => network.forward_maps(images),
            Self::Paper(network) => network.forward_maps(images),
            Self::R50F(network) => network.forward_maps(images),
        }
    }

    /// Whether the network says [`OUTSIDE`] in its maps where the object is not seen; the compact network says it
    /// with the mask alone.
    pub fn says_outside(&self) -> bool {
        !matches!(self, Self::Compact(_))
    }

    /// The same function for inference: weight standardisation and batch normalisation are baked into the
    /// convolutions.
    pub fn fold(self) -> Self {
        match self {
            Self::Compact(network) => Self::Compact(network.fold()),
            Self::Paper(network) => Self::Paper(network.fold()),
            Self::R50F(network) => Self::R50F(network.fold()),
        }
    }
}
