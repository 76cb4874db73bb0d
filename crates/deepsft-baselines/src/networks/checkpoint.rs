//! Trained networks as folders.

use super::rival::{Rival, RivalNetwork};
use anyhow::{Context, Result, bail, ensure};
use burn::module::Module;
use burn::optim::ModuleOptimizer;
use burn::store::ModuleRecord;
use burn::tensor::{Bytes, Device};
use deepsft_formats::{FolderKind, StagedFolder, recover_folder, sha256, template_fingerprint};
use deepsft_geometry::Template;
use serde::{Deserialize, Serialize};
use std::{fs, path::Path};

const STATE: &str = "state.json";
const NETWORK: &str = "network.bpk";
const OPTIMIZER: &str = "optimizer.bpk";
const FOLDER: FolderKind = FolderKind {
    known_by: &[STATE],
    files: &[STATE, NETWORK, OPTIMIZER],
};

/// What a network is and how far its training is.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct TrainingState {
    /// The network.
    pub method: Rival,
    /// What its widths are divided by.
    pub width_divisor: usize,
    /// Samples in a batch, and their seed.
    pub batch: usize,
    pub seed: u64,
    /// SHA-256 of the template.
    pub template: String,
    /// Updates made, and seconds that they took.
    pub updates: u64,
    pub seconds: f64,
    /// Mean loss of the updates between two saved checkpoints.
    pub losses: Vec<f64>,
    /// SHA-256 of network and optimiser.
    #[serde(default)]
    pub files: [String; 2],
}

impl TrainingState {
    /// The samples seen.
    pub fn samples(&self) -> u64 {
        self.updates * self.batch as u64
    }
}

/// A network, its optimiser's file and its state as they were saved.
#[derive(Debug)]
pub struct Checkpoint {
    pub state: TrainingState,
    pub network: RivalNetwork,
    optimizer: Vec<u8>,
}

impl Checkpoint {
    /// Saves into `folder`, whole or not at all.
    ///
    /// # Errors
    /// Names the file that cannot be written.
    pub fn save(
        folder: &Path,
        state: &TrainingState,
        network: RivalNetwork,
        optimizer: &ModuleOptimizer,
    ) -> Result<()> {
        let network = network
            .into_record()
            .into_bytes()
            .ok()
            .context("weights that cannot be saved")?;
        let optimizer = optimizer
            .into_bytes()
            .ok()
            .context("an optimiser that cannot be saved")?;
        let mut state = state.clone();
        state.files = [sha256(&network), sha256(&optimizer)];
        let staged = StagedFolder::new(folder, &FOLDER)?;
        staged.write(NETWORK, &network)?;
        staged.write(OPTIMIZER, &optimizer)?;
        staged.write(STATE, &serde_json::to_vec_pretty(&state)?)?;
        Ok(staged.commit()?)
    }

    /// Reads the checkpoint in `folder` onto `device`, which is differentiable for training; `None` when there is none.
    ///
    /// # Errors
    /// Names the file that cannot be read or is not as it was saved, and a network of another template.
    pub fn read(folder: &Path, template: &Template, device: &Device) -> Result<Option<Self>> {
        recover_folder(folder)?;
        let path = folder.join(STATE);
        if !path.exists() {
            return Ok(None);
        }
        let read = |name: &str| {
            let path = folder.join(name);
            fs::read(&path).with_context(|| path.display().to_string())
        };
        let state: TrainingState = serde_json::from_slice(&read(STATE)?).with_context(|| path.display().to_string())?;
        let is_same = state.template == template_fingerprint(template);
        ensure!(
            is_same,
            "{}: it was trained for another template; train one for this",
            path.display()
        );
        // burn panics at some files: it reads none but those that were saved.
        let whole = |name: &str, sha: &str| {
            let bytes = read(name)?;
            let is_whole = sha256(&bytes) == sha;
            ensure!(
                is_whole,
                "{}: it is not as it was saved; train anew",
                folder.join(name).display()
            );
            Ok(bytes)
        };
        let (weights, optimizer) = (whole(NETWORK, &state.files[0])?, whole(OPTIMIZER, &state.files[1])?);
        let grid = template.grid().context("the template is no sheet")?;
        let network = RivalNetwork::new(state.method, grid, state.width_divisor, device);
        let record = ModuleRecord::from_bytes(Bytes::from_bytes_vec(weights));
        let loaded = record.ok().and_then(|record| network.try_load_record(record).ok());
        let Some(network) = loaded else {
            bail!(
                "{}: the weights are of another network; train anew",
                folder.join(NETWORK).display()
            );
        };
        Ok(Some(Self {
            state,
            network,
            optimizer,
        }))
    }

    /// The optimiser, continued by `fresh`.
    ///
    /// # Errors
    /// For the file of another optimiser.
    pub fn optimizer(&mut self, fresh: ModuleOptimizer) -> Result<ModuleOptimizer> {
        let bytes = Bytes::from_bytes_vec(std::mem::take(&mut self.optimizer));
        fresh
            .from_bytes(bytes)
            .ok()
            .context("the optimiser's file is of another optimiser; train anew")
    }
}
