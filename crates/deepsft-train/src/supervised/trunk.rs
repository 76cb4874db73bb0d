//! The trunk of another network, which a training may begin with.

use crate::error::TrainError;
use deepsft::{WEIGHTS_FILE, Weights, weights_from_burnpack};
use deepsft_formats::{FormatError, read_error, sha256};
use deepsft_network::NetworkError;
use std::fs;
use std::path::{Path, PathBuf};

/// The file whose trunk a network begins with.
pub(super) struct Trunk {
    pub path: PathBuf,
    /// Of the file's bytes.
    pub sha256: String,
    pub weights: Weights,
}

impl Trunk {
    pub fn read(folder: &Path) -> Result<Self, TrainError> {
        let path = folder.join(WEIGHTS_FILE);
        let unreadable = |error| FormatError::unusable("weights to begin with", &path, read_error(error));
        let file = fs::read(&path).map_err(unreadable)?;
        let weights = weights_from_burnpack(&file).map_err(|error| NetworkError::Weights {
            file: path.display().to_string(),
            reason: error.to_string(),
        })?;
        Ok(Self {
            sha256: sha256(&file),
            weights,
            path,
        })
    }
}
