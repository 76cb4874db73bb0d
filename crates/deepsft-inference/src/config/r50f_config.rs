//! Layers of R50F.

use super::limits::{check_momentum, within};
use deepsft_geometry::{CANONICAL_HEIGHT, CANONICAL_WIDTH};
use serde::{Deserialize, Serialize};

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
    /// See [`super::PaperConfig::momentum`].
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

    /// Describes a network of `1 / divisor` of the widths, see [`super::PaperConfig::narrow`].
    pub fn narrow(width_divisor: usize) -> Self {
        Self {
            width_divisor,
            momentum: 0.1,
            ..Self::default()
        }
    }

    /// See [`super::NetworkConfig::check`].
    pub(super) fn check(&self) -> Result<(), String> {
        within("width_divisor", self.width_divisor, 1, 64)?;
        within("neurons", self.neurons, self.width_divisor, 1024)?;
        let values = self.dense_values();
        if values > MAX_DENSE_VALUES {
            return Err(format!(
                "neurons is {}, with which the dense layers have {values} values, expected at most {MAX_DENSE_VALUES}",
                self.neurons
            ));
        }
        check_momentum(self.momentum)
    }

    /// Values of the weights of both dense layers.
    fn dense_values(&self) -> usize {
        let neurons = self.neurons / self.width_divisor;
        let (columns, rows) = Self::ENCODED_SIZE;
        let inputs = Self::ENCODED_CHANNELS / self.width_divisor * columns * rows;
        (inputs + 1) * neurons + (neurons + 1) * Self::MAP_VALUES
    }
}
