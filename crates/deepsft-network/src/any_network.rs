//! A network of any architecture.

use super::block::Block;
use super::compact::CompactNetwork;
use super::description::{LayerDescription, LayerTable};
use super::maps::NetworkMaps;
use super::paper::PaperNetwork;
use super::r50f::R50FNetwork;
use super::weight_init::WeightInit;
use burn::module::Module;
use burn::tensor::{Device, Tensor};
use deepsft_inference::{Architecture, NetworkConfig};

/// A value of the network in `$network`, whichever it is.
macro_rules! any {
    ($network:expr, $inner:ident => $value:expr) => {
        match $network {
            Network::Compact($inner) => $value,
            Network::Paper($inner) => $value,
            Network::R50F($inner) => $value,
        }
    };
}

/// `$network` with another of its kind inside.
macro_rules! same_kind {
    ($network:expr, $inner:ident => $value:expr) => {
        match $network {
            Network::Compact($inner) => Network::Compact($value),
            Network::Paper($inner) => Network::Paper($value),
            Network::R50F($inner) => Network::R50F($value),
        }
    };
}

pub(super) use {any, same_kind};

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
        any!(self, network => &network.config)
    }

    /// The compact network, if it is one: only that has cells, bins and windows of frames.
    pub fn as_compact(&self) -> Option<&CompactNetwork> {
        match self {
            Self::Compact(network) => Some(network),
            _ => None,
        }
    }

    /// Computes the maps of images [B, 3, H, W] of the training camera, values 0..=1. They are differentiable with respect to
    /// all weights that are trained (see [`Network::train_only`]). The compact network takes any size; the paper's network and
    /// R50F take 270 x 480 only (H x W).
    ///
    /// On a device with differentiation batch normalisation that is trained uses the statistics of the batch and
    /// updates its running ones; frozen, validating ([`burn::module::Module::valid`]) or folded it uses the latter.
    ///
    /// # Panics
    /// Like all of burn's operations when the shape is another one.
    pub fn forward_maps(&self, images: Tensor<4>) -> NetworkMaps {
        any!(self, network => network.forward_maps(images))
    }

    /// Returns whether the maps hold [`crate::OUTSIDE`] where the object is not seen. The compact network says it with the mask
    /// alone.
    pub fn says_outside(&self) -> bool {
        !matches!(self, Self::Compact(_))
    }

    /// Freezes all blocks but `blocks`. Step 2 of the paper's section 4 trains the depth refinement, step 3 the registration
    /// refinement. The weights of the others get no gradients, and their batch normalisation uses and keeps its running
    /// statistics. `train_only(Block::ALL)` trains everything again.
    pub fn train_only(self, blocks: &[Block]) -> Self {
        Block::ALL
            .iter()
            .fold(self, |network, block| match blocks.contains(block) {
                true => network.unfreeze_group(block.group()),
                false => network.freeze_group(block.group()),
            })
    }

    /// Lists the layers of all blocks in their order, for one 480 x 270 image. A folded network has no batch normalisation any
    /// more, so fewer parameters.
    pub fn describe(&self) -> Vec<LayerDescription> {
        let mut table = LayerTable::new();
        any!(self, network => network.describe(&mut table));
        table.layers
    }

    /// Initialises a network of `config` with random weights.
    pub fn new(config: &NetworkConfig, device: &Device) -> Self {
        Self::with_init(config, device, true)
    }

    /// A network with random weights (`drawn`), or a folded one whose weights are still to be loaded.
    pub(crate) fn with_init(config: &NetworkConfig, device: &Device, drawn: bool) -> Self {
        let init = |momentum| WeightInit::new(device, drawn, momentum);
        match &config.architecture {
            Architecture::Compact(shape) => Self::Compact(CompactNetwork::new(shape, config, init(0.0))),
            Architecture::Paper(shape) => Self::Paper(PaperNetwork::new(shape, config, init(shape.momentum))),
            Architecture::R50F(shape) => Self::R50F(R50FNetwork::new(shape, config, init(shape.momentum))),
        }
    }
}
