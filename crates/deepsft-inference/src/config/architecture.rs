//! The architectures of networks and the layers of each, within limits.

use crate::stage::Stage;
use deepsft_geometry::{CANONICAL_HEIGHT, CANONICAL_WIDTH};
use serde::{Deserialize, Serialize};
use std::fmt::Display;

/// The architecture of a network, with its layers.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "architecture", rename_all = "lowercase")]
pub enum Architecture {
    /// The network that ships: the paper's structure with a 67th of its parameters and a 250th of its operations.
    Compact(CompactConfig),
    /// The paper's network.
    Paper(PaperConfig),
    /// The method the paper compares itself with first: a ResNet-50 with dense layers.
    R50F(R50FConfig),
}

impl Architecture {
    /// Returns its name in a `model.json`.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Compact(_) => "compact",
            Self::Paper(_) => "paper",
            Self::R50F(_) => "r50f",
        }
    }

    /// Returns the stages at which maps can be read, in their order; the last is the answer. R50F has no refinement blocks.
    pub fn stages(&self) -> &'static [Stage] {
        match self {
            Self::R50F(_) => &[Stage::Main],
            Self::Compact(_) | Self::Paper(_) => &[Stage::Main, Stage::DepthRefinement, Stage::RegistrationRefinement],
        }
    }

    /// See [`super::NetworkConfig::check`].
    pub(super) fn check(&self) -> Result<(), String> {
        match self {
            Self::Compact(shape) => shape.check(),
            Self::Paper(shape) => shape.check(),
            Self::R50F(shape) => shape.check(),
        }
    }
}

/// Layers of the compact network.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct CompactConfig {
    /// Channels at strides 4, 8, 16 and 32.
    pub channels: [usize; 4],
    /// Residual blocks at stride 32.
    pub blocks_at_32: usize,
    /// Bins for u, v and depth; of a network that says rest positions for x, y, depth and z.
    pub bins: Vec<usize>,
    /// Width of the two refinement blocks.
    pub refinement_channels: usize,
    /// Width of the mask head at stride 4.
    pub mask_channels: usize,
}

impl Default for CompactConfig {
    fn default() -> Self {
        Self {
            channels: [32, 48, 96, 160],
            blocks_at_32: 2,
            bins: vec![32, 24, 24],
            refinement_channels: 32,
            mask_channels: 24,
        }
    }
}

impl CompactConfig {
    /// Returns whether the network says [rest positions](deepsft_geometry::RestSurface) (x, y, z) in place of (u, v), as of
    /// every template that is no sheet: they do not jump at seams of the texture.
    pub fn has_rest_positions(&self) -> bool {
        self.bins.len() == 4
    }

    fn check(&self) -> Result<(), String> {
        // All at their most: 115 million weights, about as many as the paper's network has.
        self.channels.iter().try_for_each(|&c| within("channels", c, 1, 512))?;
        within("blocks_at_32", self.blocks_at_32, 0, 16)?;
        within("the number of bins", self.bins.len(), 3, 4)?;
        self.bins.iter().try_for_each(|&b| within("bins", b, 2, 512))?;
        within("refinement_channels", self.refinement_channels, 1, 512)?;
        within("mask_channels", self.mask_channels, 1, 512)
    }
}

/// Layers of the paper's network.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct PaperConfig {
    /// All widths are divided by this, 1 to 64: 1 is the paper's network. Narrow ones are ours, for tests and small
    /// machines; cost goes with the square.
    pub width_divisor: usize,
    /// Weight of a batch's mean and variance in batch normalisation's running ones. 0.01 as in Keras; short trainings
    /// need more, since the running values must arrive before the training ends.
    pub momentum: f64,
}

impl Default for PaperConfig {
    fn default() -> Self {
        Self {
            width_divisor: 1,
            momentum: 0.01,
        }
    }
}

impl PaperConfig {
    /// Describes a network of `1 / divisor` of the paper's widths with running statistics that follow within tens of steps.
    pub fn narrow(width_divisor: usize) -> Self {
        Self {
            width_divisor,
            momentum: 0.1,
        }
    }

    fn check(&self) -> Result<(), String> {
        // Widths are only ever divided: no description asks for more than the paper's 109 million weights.
        within("width_divisor", self.width_divisor, 1, 64)?;
        within("momentum", self.momentum, 0.0, 1.0)
    }
}

/// Most values of the two dense layers together. The paper's R50F has 133 million of them, 0.5 GB, and nothing is
/// gained by many more neurons (our choice).
const MAX_DENSE_VALUES: usize = 200_000_000;

/// Layers of R50F.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct R50FConfig {
    /// The encoder's widths and the neurons are divided by this, 1 to 64: 1 is the paper's R50F, others are ours.
    pub width_divisor: usize,
    /// Neurons of the first dense layer before the division.
    pub neurons: usize,
    /// See [`PaperConfig::momentum`].
    pub momentum: f64,
}

impl Default for R50FConfig {
    fn default() -> Self {
        Self {
            width_divisor: 1,
            neurons: 200,
            momentum: 0.01,
        }
    }
}

impl R50FConfig {
    /// Columns and rows of the encoder's last map, stride 32.
    pub const ENCODED_SIZE: (usize, usize) = (CANONICAL_WIDTH.div_ceil(32), CANONICAL_HEIGHT.div_ceil(32));

    /// Channels of that map in full width.
    pub const ENCODED_CHANNELS: usize = 2048;

    /// Maps of the last dense layer: depth, u, v.
    pub const MAPS: usize = 3;

    /// Values of these maps.
    pub const MAP_VALUES: usize = Self::MAPS * CANONICAL_HEIGHT * CANONICAL_WIDTH;

    /// Describes a network of `1 / divisor` of the widths, see [`PaperConfig::narrow`].
    pub fn narrow(width_divisor: usize) -> Self {
        Self {
            width_divisor,
            momentum: 0.1,
            ..Self::default()
        }
    }

    fn check(&self) -> Result<(), String> {
        within("width_divisor", self.width_divisor, 1, 64)?;
        within("neurons", self.neurons, self.width_divisor, 1024)?;
        // The values of the weights of both dense layers.
        let neurons = self.neurons / self.width_divisor;
        let (columns, rows) = Self::ENCODED_SIZE;
        let inputs = Self::ENCODED_CHANNELS / self.width_divisor * columns * rows;
        let values = (inputs + 1) * neurons + (neurons + 1) * Self::MAP_VALUES;
        if values > MAX_DENSE_VALUES {
            return Err(format!(
                "neurons is {}, with which the dense layers have {values} values, expected at most {MAX_DENSE_VALUES}",
                self.neurons
            ));
        }
        within("momentum", self.momentum, 0.0, 1.0)
    }
}

/// Whether `value` of the field `field` lies within `least..=most`.
fn within<T: Copy + Display + PartialOrd>(field: &str, value: T, least: T, most: T) -> Result<(), String> {
    if (least..=most).contains(&value) {
        Ok(())
    } else {
        Err(format!("{field} is {value}, expected {least} to {most}"))
    }
}
