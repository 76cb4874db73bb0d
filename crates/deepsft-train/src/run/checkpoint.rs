//! Checkpoints: everything a training needs to go on, swapped in whole or not at all.

use super::fingerprint::Fingerprint;
use crate::error::TrainError;
use burn::module::Module;
use burn::optim::ModuleOptimizer;
use burn::store::ModuleRecord;
use burn::tensor::Bytes;
use deepsft_formats::{
    FolderKind, FormatError, StagedFolder, json_reason, read_error, recover_folder, sha256, write_error,
};
use deepsft_network::Network;
use serde::de::DeserializeOwned;
use serde::{Deserialize, Deserializer, Serialize};
use std::collections::BTreeMap;
use std::fmt::Display;
use std::path::{Path, PathBuf};
use std::{fs, io};

/// A point of the training curve: the averaged network on the fixed held-out set.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct CurvePoint {
    /// Training samples seen.
    pub samples: u64,
    /// Seconds of training.
    pub seconds: f64,
    /// Mean training loss since the last point; not a number before the first step. JSON, which knows finite numbers
    /// only, has null there.
    #[serde(deserialize_with = "nan_for_null")]
    pub loss: f64,
    /// Learning rate.
    pub learning_rate: f64,
    /// Median over held-out frames of the registration RMSE, pixels.
    pub registration_rmse_px: Option<f64>,
    /// Median of the depth RMSE, mm.
    pub depth_rmse_mm: Option<f64>,
    /// Mean mask IoU.
    pub mask_iou: Option<f64>,
    /// Median of the photometric error E_pr, intensities in 0..=1; of steps 2 and 3.
    pub photo_consistency_error: Option<f64>,
}

fn nan_for_null<'de, D: Deserializer<'de>>(deserializer: D) -> Result<f64, D::Error> {
    Ok(Option::deserialize(deserializer)?.unwrap_or(f64::NAN))
}

/// Where a training stands.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Checkpoint {
    /// Updates of the weights made.
    pub step: u64,
    /// Samples seen.
    pub samples: u64,
    /// Seconds spent training, evaluation left out.
    pub seconds: f64,
    /// What it belongs to: samples or frames, network, settings.
    pub fingerprint: Fingerprint,
    /// The seed.
    pub seed: u64,
    /// The curve so far.
    pub curve: Vec<CurvePoint>,
}

/// What `state.json` holds.
#[derive(Serialize, Deserialize)]
struct StateFile<S> {
    #[serde(flatten)]
    state: S,
    /// The SHA-256 of the files beside it. burn, which panics at some others, reads none but those that were saved.
    files: BTreeMap<String, String>,
}

/// A checkpoint whose state was read, and whose files can be.
#[derive(Debug)]
pub struct SavedFiles<S> {
    /// Where the training stood.
    pub state: S,
    folder: PathBuf,
    files: BTreeMap<String, String>,
}

impl<S> SavedFiles<S> {
    /// Loads the network of a file into a `fresh` one. It must be no clone of another: clones share the running statistics of batch
    /// normalisation.
    ///
    /// # Errors
    /// [`FormatError::Unusable`] when the file cannot be read, is not as it was saved or of another network.
    pub fn network<M: Module>(&self, name: &str, fresh: M) -> Result<M, TrainError> {
        let path = self.folder.join(name);
        let record = ModuleRecord::from_bytes(self.bytes(name)?).map_err(at(&path))?;
        Ok(fresh.try_load_record(record).map_err(at(&path))?)
    }

    /// Loads the optimiser into a `fresh` one.
    ///
    /// # Errors
    /// As [`SavedFiles::network`].
    pub fn optimizer(&self, fresh: ModuleOptimizer) -> Result<ModuleOptimizer, TrainError> {
        let bytes = self.bytes(OPTIMIZER)?;
        Ok(fresh.from_bytes(bytes).map_err(at(&self.folder.join(OPTIMIZER)))?)
    }

    fn bytes(&self, name: &str) -> Result<Bytes, TrainError> {
        let path = self.folder.join(name);
        let bytes = fs::read(&path).map_err(read_error).map_err(at(&path))?;
        if self.files.get(name) != Some(&sha256(&bytes)) {
            let reason = "it is not as it was saved: remove the checkpoint, or train without --resume";
            return Err(at(&path)(reason).into());
        }
        Ok(Bytes::from_bytes_vec(bytes))
    }
}

/// A checkpoint of the three training steps that was read.
pub struct Saved {
    /// Where the training stood.
    pub state: Checkpoint,
    /// The network as it was trained.
    pub network: Network,
    /// The average of its weights, where there was one.
    pub average: Option<Network>,
    /// The optimiser.
    pub optimizer: ModuleOptimizer,
}

impl std::fmt::Debug for Saved {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Saved")
            .field("state", &self.state)
            .finish_non_exhaustive()
    }
}

const STATE: &str = "state.json";
/// The file of a checkpoint's network.
pub const NETWORK_FILE: &str = "network.bpk";
const AVERAGE: &str = "average.bpk";
const OPTIMIZER: &str = "optimizer.bpk";

/// The folder of a checkpoint.
const CHECKPOINT_FOLDER: FolderKind = FolderKind {
    known_by: &[STATE],
    files: &[STATE, NETWORK_FILE, AVERAGE, OPTIMIZER],
};

/// A folder that holds one checkpoint, whole at any moment (see [`StagedFolder`]). One training at a time may use it.
#[derive(Debug)]
pub struct CheckpointFolder {
    folder: PathBuf,
}

impl CheckpointFolder {
    /// The checkpoint folder at `folder`; it need not exist.
    pub fn new(folder: impl Into<PathBuf>) -> Self {
        Self { folder: folder.into() }
    }

    /// Reads where the training of the checkpoint stands; `None` when there is none.
    ///
    /// # Errors
    /// [`FormatError::Unusable`] when its state cannot be read.
    pub fn read<S: DeserializeOwned>(&self) -> Result<Option<SavedFiles<S>>, TrainError> {
        recover_folder(&self.folder)?;
        let path = self.folder.join(STATE);
        let bytes = match fs::read(&path) {
            Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(None),
            bytes => bytes.map_err(read_error).map_err(at(&path))?,
        };
        let StateFile { state, files } =
            serde_json::from_slice(&bytes).map_err(|error| at(&path)(json_reason(&error)))?;
        let folder = self.folder.clone();
        Ok(Some(SavedFiles { state, folder, files }))
    }

    /// Puts the checkpoint aside, under a name that is free, so that the training it belongs to begins anew. Returns where
    /// it is kept.
    ///
    /// # Errors
    /// [`FormatError::Write`] when there is none or it cannot be renamed.
    pub(crate) fn set_aside(&self) -> Result<PathBuf, TrainError> {
        let named = |ending: String| {
            let mut name = self.folder.file_name().unwrap_or_default().to_os_string();
            name.push(ending);
            self.folder.with_file_name(name)
        };
        let mut aside = named(".outdated".to_owned());
        let mut number = 1;
        while aside.exists() {
            number += 1;
            aside = named(format!(".outdated-{number}"));
        }
        let unwritten = |error| FormatError::unwritten(&self.folder, write_error(error));
        fs::rename(&self.folder, &aside).map_err(unwritten)?;
        Ok(aside)
    }

    /// Saves a checkpoint; `average` is the average of the weights where there is one.
    ///
    /// # Errors
    /// [`FormatError`] names the file that cannot be written;
    /// [`TrainError::WeightsNotFinite`] when a weight is no finite number. The checkpoint before stays then.
    pub fn save(
        &self,
        state: &Checkpoint,
        network: &Network,
        average: Option<&Network>,
        optimizer: &ModuleOptimizer,
    ) -> Result<(), TrainError> {
        if !std::iter::once(network).chain(average).all(has_finite_weights) {
            return Err(TrainError::WeightsNotFinite {
                samples: state.samples,
                path: self.folder.clone(),
            });
        }
        let average = average.map(|average| (AVERAGE, average));
        let networks: Vec<_> = [(NETWORK_FILE, network)].into_iter().chain(average).collect();
        self.write(state, &networks, optimizer)
    }

    /// Writes a checkpoint of any training: its `state`, networks by the names of their files, the optimiser.
    ///
    /// # Errors
    /// [`FormatError`] names the file that cannot be written. The checkpoint before stays then.
    pub fn write<S: Serialize, M: Module>(
        &self,
        state: &S,
        networks: &[(&str, &M)],
        optimizer: &ModuleOptimizer,
    ) -> Result<(), TrainError> {
        let staged = StagedFolder::new(&self.folder, &CHECKPOINT_FOLDER)?;
        let mut files = BTreeMap::new();
        let mut write = |name: &str, bytes: Bytes| -> Result<(), TrainError> {
            files.insert(name.to_owned(), sha256(&bytes));
            Ok(staged.write(name, &bytes)?)
        };
        for (name, network) in networks {
            let record = (*network).clone().into_record().into_bytes();
            write(name, record.map_err(at(&self.folder.join(name)))?)?;
        }
        let optimizer = optimizer.into_bytes();
        write(OPTIMIZER, optimizer.map_err(at(&self.folder.join(OPTIMIZER)))?)?;
        let file = serde_json::to_vec_pretty(&StateFile { state, files });
        staged.write(STATE, &file.map_err(at(&self.folder.join(STATE)))?)?;
        Ok(staged.commit()?)
    }

    /// Loads the checkpoint into networks of `make_network` and `optimizer`; `None` when there is none. `make_network` must not
    /// clone one network: clones share the running statistics of batch normalisation.
    ///
    /// # Errors
    /// [`FormatError::Unusable`] when a file cannot be read or does not fit,
    /// [`TrainError::CheckpointMismatch`] when it was made with another configuration or seed.
    pub fn load(
        &self,
        make_network: impl Fn() -> Result<Network, TrainError>,
        optimizer: ModuleOptimizer,
        fingerprint: &Fingerprint,
        seed: u64,
    ) -> Result<Option<Saved>, TrainError> {
        let Some(saved) = self.read::<Checkpoint>()? else {
            return Ok(None);
        };
        let seeds = (saved.state.seed != seed).then(|| "seed".to_owned());
        if let Some(what) = fingerprint.difference(&saved.state.fingerprint).or(seeds) {
            return Err(TrainError::CheckpointMismatch {
                what,
                path: self.folder.clone(),
            });
        }
        let load = |name: &str| saved.network(name, make_network()?);
        Ok(Some(Saved {
            network: load(NETWORK_FILE)?,
            average: saved.files.contains_key(AVERAGE).then(|| load(AVERAGE)).transpose()?,
            optimizer: saved.optimizer(optimizer)?,
            state: saved.state,
        }))
    }
}

fn has_finite_weights(network: &Network) -> bool {
    let mut finite = true;
    network.each_weight(|_, values| finite &= values.convert::<f32>().iter::<f32>().all(f32::is_finite));
    finite
}

/// Blames what failed on the file at `path`.
fn at<E: Display>(path: &Path) -> impl Fn(E) -> FormatError {
    move |error| FormatError::unusable("checkpoint", path, error)
}

#[cfg(test)]
mod tests {
    use super::*;
    use burn::module::Param;
    use burn::tensor::Tensor;

    fn network() -> Network {
        let camera = deepsft_geometry::training_camera();
        Network::new(
            &deepsft::NetworkConfig::compact([297.0, 210.0], &camera),
            &burn::tensor::Device::flex(),
        )
    }

    #[test]
    fn weights_that_are_not_finite_are_not_saved() {
        struct Spoil;
        impl burn::module::ModuleMapper for Spoil {
            fn map_float<const D: usize>(&mut self, param: Param<Tensor<D>>) -> Param<Tensor<D>> {
                param.map(|weight| weight * f32::INFINITY)
            }
        }
        let folder = tempfile::tempdir().unwrap();
        let checkpoint = CheckpointFolder::new(folder.path().join("model.checkpoint"));
        let optimizer = burn::optim::SgdConfig::new().init();
        let (good, spoilt) = (network(), network().map(&mut Spoil));
        let state = |samples| Checkpoint {
            samples,
            ..Checkpoint::default()
        };
        checkpoint.save(&state(7), &good, None, &optimizer).unwrap();
        for (network, average) in [(&spoilt, None), (&good, Some(&spoilt))] {
            let error = checkpoint.save(&state(14), network, average, &optimizer).unwrap_err();
            assert!(
                matches!(error, TrainError::WeightsNotFinite { samples: 14, .. }),
                "{error}"
            );
        }
        assert_eq!(checkpoint.read::<Checkpoint>().unwrap().unwrap().state.samples, 7);
    }
}
