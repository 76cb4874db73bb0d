//! Networks without burn: the shortest way from an image to maps.

use super::any_network::Network;
use deepsft_inference::{Architecture, CompactExecutor, PlanError, available_threads};

impl Network {
    /// The network for the processor alone, for images of `width` x `height` pixels: the same function, several times as fast as on
    /// burn's CPU device. `None` for architectures that have no such executor (the paper's network, R50F).
    ///
    /// The network is folded; it runs on [`available_threads`]. Its weights are read at once:
    /// native only, or a network on the CPU.
    ///
    /// # Errors
    /// [`PlanError`] for a network whose weights do not fit its description.
    pub fn executor(&self, width: usize, height: usize) -> Result<Option<CompactExecutor>, PlanError> {
        if !matches!(self.config().architecture, Architecture::Compact(_)) {
            return Ok(None);
        }
        let arrays = self.clone().fold().weight_arrays().into_iter();
        let weights = arrays.map(|array| (array.name, array.values)).collect();
        CompactExecutor::new(self.config(), [width, height], &weights, available_threads()).map(Some)
    }
}
