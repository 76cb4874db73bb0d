//! Layers of R50F.

use super::limits::{check_momentum, within};
use deepsft_geometry::{CANONICAL_HEIGHT, CANONICAL_WIDTH};
use serde::{Deserialize, Serialize};

/// Rows and columns of the encoder's last map, stride 32.
pub(in crate::network) const ENCODED: [usize; 2] = [CANONICAL_HEIGHT.div_ceil(32), CANONICAL_WIDTH.div_ceil(32)];

/// Channels of that map in full width.
pub(in crate::network) const ENCODED_WIDTH: usize = 2048;

/// Maps of the last dense layer: depth, u, v.
pub(in crate::network) const MAPS: usize = 3;

/// Values of these maps.
pub(in crate::network) const MAP_VALUES: usize = MAPS * CANONICAL_HEIGHT * CANONICAL_WIDTH;

/// Most values of the two dense layers together. The paper's R50F has 133 million of them, 0.5 GB, and nothing is
/// gained by many more neurons (our choice).
const MOST_DENSE_VALUES: usize = 200_000_000;

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
    /// A network of `1 / divisor` of the widths, see [`super::PaperConfig::narrow`].
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
        if values > MOST_DENSE_VALUES {
            return Err(format!(
                "neurons is {}, with which the dense layers have {values} values, expected at most {MOST_DENSE_VALUES}",
                self.neurons
            ));
        }
        check_momentum(self.momentum)
    }

    /// Values of the weights of both dense layers.
    fn dense_values(&self) -> usize {
        let neurons = self.neurons / self.width_divisor;
        let (inputs, outputs) = (ENCODED_WIDTH / self.width_divisor * ENCODED[0] * ENCODED[1], MAP_VALUES);
        (inputs + 1) * neurons + (neurons + 1) * outputs
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_description_asks_for_more_than_half_as_much_again_as_the_papers() {
        let checked = |width_divisor, neurons| {
            let config = R50FConfig {
                width_divisor,
                neurons,
                ..R50FConfig::default()
            };
            config.check().map(|()| config.dense_values())
        };
        // 9 x 15 x 2048 values and one to 200 neurons, those and one to 3 x 270 x 480 values.
        assert_eq!(checked(1, 200), Ok(276_481 * 200 + 201 * 388_800));
        assert!(checked(1, 300).is_ok() && checked(8, 1024).is_ok());
        for (divisor, neurons) in [(1, 301), (1, 1024), (2, 1024)] {
            let refusal = checked(divisor, neurons).unwrap_err();
            assert!(
                refusal.contains("neurons is") && refusal.contains("at most"),
                "{refusal}"
            );
        }
        assert!(checked(1, usize::MAX).is_err() && checked(0, 200).is_err());
    }
}
