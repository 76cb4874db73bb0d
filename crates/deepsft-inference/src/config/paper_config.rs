//! Layers of the paper's network.

use super::limits::{check_momentum, within};
use serde::{Deserialize, Serialize};

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

    /// See [`super::NetworkConfig::check`].
    pub(super) fn check(&self) -> Result<(), String> {
        // Widths are only ever divided: no description asks for more than the paper's 109 million weights.
        within("width_divisor", self.width_divisor, 1, 64)?;
        check_momentum(self.momentum)
    }
}
