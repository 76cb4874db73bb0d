//! Finished networks: what training leaves for those who only run them.

use crate::compact::CompactPlan;
use crate::config::{Architecture, NetworkConfig};
use crate::cpu::available_threads;
use crate::executor::Executor;
use crate::plan::PlanError;
use crate::residual::ResidualPlan;
use crate::weights::Weights;
use deepsft_geometry::ImageSize;

/// A network with its weights, normalisation folded into the convolutions.
#[derive(Clone, Debug, PartialEq)]
pub struct FoldedNetwork {
    /// How it is built.
    pub config: NetworkConfig,
    /// Its weights.
    pub weights: Weights,
}

impl FoldedNetwork {
    /// Returns the number of weights.
    pub fn parameters(&self) -> usize {
        self.weights.values().map(|array| array.values.len()).sum()
    }

    /// Prepares the network for the processor, for images of `image` (columns, rows) pixels, on [`available_threads`].
    ///
    /// # Errors
    /// As [`Executor::new`].
    pub fn executor(&self, image: impl Into<ImageSize>) -> Result<Executor, PlanError> {
        Executor::new(&self.config, image, &self.weights, available_threads())
    }

    /// Checks that the weights are those of the description.
    ///
    /// # Errors
    /// [`PlanError`] names what is absent, has no place or does not fit.
    pub fn check(&self) -> Result<(), PlanError> {
        match self.config.architecture {
            Architecture::Compact(_) => CompactPlan::new([1, 1], &self.config, &self.weights).map(|_| ()),
            _ => ResidualPlan::new(&self.config, &self.weights).map(|_| ()),
        }
    }
}
