//! Layers of the compact network.

use super::limits::within;
use serde::{Deserialize, Serialize};
use std::ops::Not;

/// Layers of the compact network.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct CompactConfig {
    /// Channels at strides 4, 8, 16 and 32.
    pub channels: [usize; 4],
    /// Residual blocks at stride 32.
    pub blocks_at_32: usize,
    /// Bins for u, v and depth.
    pub bins: [usize; 3],
    /// Width of the two refinement blocks.
    pub refinement_channels: usize,
    /// Width of the mask head at stride 4.
    pub mask_channels: usize,
    /// Whether the registration jumps at seams of the texture, as on any template that is no sheet. Then the depths
    /// that are measured from the registration, which take it for one smooth chart, are left out, and cells of
    /// different charts are not mixed. Default false; descriptions without it are of sheets.
    #[serde(default, skip_serializing_if = "Not::not")]
    pub seams: bool,
}

impl Default for CompactConfig {
    fn default() -> Self {
        Self {
            channels: [32, 48, 96, 160],
            blocks_at_32: 2,
            bins: [32, 24, 24],
            refinement_channels: 32,
            mask_channels: 24,
            seams: false,
        }
    }
}

impl CompactConfig {
    /// See [`super::NetworkConfig::check`].
    pub(super) fn check(&self) -> Result<(), String> {
        // All at their most: 115 million weights, about as many as the paper's network has.
        self.channels.iter().try_for_each(|&c| within("channels", c, 1, 512))?;
        within("blocks_at_32", self.blocks_at_32, 0, 16)?;
        self.bins.iter().try_for_each(|&b| within("bins", b, 2, 512))?;
        within("refinement_channels", self.refinement_channels, 1, 512)?;
        within("mask_channels", self.mask_channels, 1, 512)
    }
}
