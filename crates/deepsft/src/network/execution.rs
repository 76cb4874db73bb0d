//! Networks without burn: the shortest way from an image to maps.

use super::any_network::Network;
use super::config::Architecture;
use deepsft_inference::{CompactExecutor, CompactShape, PlanError, available_threads};

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
        let config = self.config();
        let Architecture::Compact(compact) = &config.architecture else {
            return Ok(None);
        };
        let shape = CompactShape {
            image: [width, height],
            channels: compact.channels,
            blocks_at_32: compact.blocks_at_32,
            bins: compact.bins,
            refinement_channels: compact.refinement_channels,
            mask_channels: compact.mask_channels,
            seams: compact.seams,
            template_size_mm: config.template_size_mm,
            focal: config.focal,
            principal_point: config.principal_point,
            depth_range_mm: [config.depth_range.near_mm, config.depth_range.far_mm],
        };
        let arrays = self.clone().fold().weight_arrays().into_iter();
        let weights = arrays.map(|array| (array.name, array.values)).collect();
        CompactExecutor::new(shape, &weights, available_threads()).map(Some)
    }
}
