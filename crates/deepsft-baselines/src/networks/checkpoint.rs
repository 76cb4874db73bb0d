//! Trained networks as folders.

use super::rival::{RivalNetwork, Settings};
use anyhow::{Context, Result, ensure};
use burn::tensor::Device;
use deepsft_formats::template_fingerprint;
use deepsft_geometry::Template;
use deepsft_train::{CheckpointFolder, NETWORK_FILE, SavedFiles};
use serde::{Deserialize, Serialize};
use std::path::Path;

/// What a network is and how far its training is.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct TrainingState {
    #[serde(flatten)]
    pub settings: Settings,
    /// SHA-256 of the template.
    pub template: String,
    /// Updates made, and seconds that they took.
    pub updates: u64,
    pub seconds: f64,
    /// Mean loss of the updates between two saved checkpoints.
    pub losses: Vec<f64>,
}

impl TrainingState {
    /// Before the first update.
    pub fn new(settings: Settings, template: &Template) -> Self {
        Self {
            settings,
            template: template_fingerprint(template),
            updates: 0,
            seconds: 0.0,
            losses: Vec::new(),
        }
    }

    /// The samples seen.
    pub fn samples(&self) -> u64 {
        self.updates * self.settings.batch
    }
}

/// Reads the checkpoint in `folder`, its network onto `device`, which is differentiable for training; `None` when there is none.
/// Errors name the file that cannot be read or is not as it was saved, and a network of another template.
pub fn read_checkpoint(
    folder: &Path,
    template: &Template,
    device: &Device,
) -> Result<Option<(SavedFiles<TrainingState>, RivalNetwork)>> {
    let Some(saved) = CheckpointFolder::new(folder).read::<TrainingState>()? else {
        return Ok(None);
    };
    ensure!(
        saved.state.template == template_fingerprint(template),
        "{}: it was trained for another template; train one for this",
        folder.display()
    );
    let grid = template.grid().context("the template is no sheet")?;
    let network = saved.network(NETWORK_FILE, RivalNetwork::new(&saved.state.settings, grid, device))?;
    Ok(Some((saved, network)))
}
