//! Checkpoints: everything a training needs to go on, swapped in whole or not at all.

use super::fingerprint::Fingerprint;
use super::record_files;
use crate::device::LossScale;
use crate::error::TrainError;
use burn::module::Module;
use burn::optim::ModuleOptimizer;
use burn::store::ModuleRecord;
use burn::tensor::Bytes;
use deepsft_network::Network;
use serde::{Deserialize, Serialize};
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
    /// Mean training loss since the last point; not a number where no step since then had a finite one (before the first
    /// step, or when all overflowed in half precision). JSON, which knows finite numbers only, has null there.
    #[serde(with = "finite_or_null")]
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
    #[serde(default)]
    pub photo_consistency_error: Option<f64>,
}

/// A number that may be NaN, as JSON has it.
mod finite_or_null {
    use serde::{Deserialize, Deserializer, Serialize, Serializer};

    pub fn serialize<S: Serializer>(value: &f64, serializer: S) -> Result<S::Ok, S::Error> {
        value.is_finite().then_some(value).serialize(serializer)
    }

    pub fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<f64, D::Error> {
        Ok(Option::deserialize(deserializer)?.unwrap_or(f64::NAN))
    }
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
    /// Scale of the loss in half precision; none in single precision.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub loss_scale: Option<LossScale>,
}

/// A checkpoint that was read.
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
const NETWORK: &str = "network.bpk";
const AVERAGE: &str = "average.bpk";
const OPTIMIZER: &str = "optimizer.bpk";

/// A folder that holds one checkpoint. A new one is written beside it and renamed, so that a kill at
/// any moment leaves a whole one.
#[derive(Debug)]
pub struct CheckpointFolder {
    folder: PathBuf,
}

impl CheckpointFolder {
    /// The checkpoint folder at `folder`; it need not exist.
    pub fn new(folder: impl Into<PathBuf>) -> Self {
        Self { folder: folder.into() }
    }

    fn beside(&self, suffix: &str) -> PathBuf {
        let mut name = self.folder.file_name().unwrap_or_default().to_os_string();
        name.push(suffix);
        self.folder.with_file_name(name)
    }

    /// Where a checkpoint is looked for: its place, and the one before it, which a kill may leave alone.
    fn places(&self) -> [PathBuf; 2] {
        [self.folder.clone(), self.beside(".old")]
    }

    /// Where the newest whole checkpoint is, and where its training stands; `None` when there is none. A state that cannot
    /// be read does not hide the checkpoint before it.
    ///
    /// # Errors
    /// [`TrainError::Checkpoint`] when there are checkpoints and no state of one can be read.
    pub fn state(&self) -> Result<Option<(PathBuf, Checkpoint)>, TrainError> {
        let mut unreadable = None;
        for folder in self.places() {
            let path = folder.join(STATE);
            if !path.is_file() {
                continue;
            }
            let bytes = fs::read(&path).map_err(cannot("read", &path));
            match bytes.and_then(|bytes| serde_json::from_slice(&bytes).map_err(at(&path))) {
                Ok(state) => return Ok(Some((folder, state))),
                Err(error) => unreadable = unreadable.or(Some(error)),
            }
        }
        unreadable.map_or(Ok(None), Err)
    }

    /// Puts the newest whole checkpoint aside, under a name that is free, so that the training it belongs to begins
    /// anew. What else stands in its places is outdated or broken, and goes. Returns where the checkpoint is kept; `None`
    /// when there is none.
    ///
    /// # Errors
    /// [`TrainError::Checkpoint`] names the file.
    pub fn set_aside(&self) -> Result<Option<PathBuf>, TrainError> {
        let Some((newest, _)) = self.state()? else {
            return Ok(None);
        };
        let mut aside = self.beside(".outdated");
        let mut number = 1;
        while aside.exists() {
            number += 1;
            aside = self.beside(&format!(".outdated-{number}"));
        }
        fs::rename(&newest, &aside).map_err(cannot("rename", &newest))?;
        for place in self.places() {
            remove_if_there(&place)?;
        }
        Ok(Some(aside))
    }

    /// Saves a checkpoint; `average` is the average of the weights where there is one. Everything is on the disk before the
    /// checkpoint takes its place, so that neither a kill nor a power cut leaves half of one.
    ///
    /// # Errors
    /// [`TrainError::Checkpoint`] names the file; [`TrainError::WeightsNotFinite`] when a weight is no finite number: then
    /// the checkpoint before stays.
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
        let fresh = self.beside(".new");
        let saved = self.write(&fresh, state, network, average, optimizer);
        if saved.is_err() {
            // It may be the disk that is full.
            let _ = fs::remove_dir_all(&fresh);
        }
        saved
    }

    /// Writes a checkpoint to `fresh` and puts it in its place.
    fn write(
        &self,
        fresh: &Path,
        state: &Checkpoint,
        network: &Network,
        average: Option<&Network>,
        optimizer: &ModuleOptimizer,
    ) -> Result<(), TrainError> {
        let old = self.beside(".old");
        remove_if_there(fresh)?;
        fs::create_dir_all(fresh).map_err(cannot("make", fresh))?;
        let write = |path: &Path, bytes: &[u8]| deepsft_formats::write_file(path, bytes).map_err(at(path));
        let record = |network: &Network| network.clone().into_record().into_bytes().map_err(|e| e.to_string());
        let mut files = vec![
            (NETWORK, record(network)),
            (OPTIMIZER, optimizer.into_bytes().map_err(|e| e.to_string())),
        ];
        files.extend(average.map(|average| (AVERAGE, record(average))));
        for (name, bytes) in files {
            let path = fresh.join(name);
            write(&path, &bytes.map_err(at(&path))?)?;
        }
        // Last: a folder without a state is not a checkpoint.
        let path = fresh.join(STATE);
        write(&path, &serde_json::to_vec_pretty(state).map_err(at(&path))?)?;
        sync(fresh)?;
        if is_whole(&self.folder) {
            remove_if_there(&old)?;
            fs::rename(&self.folder, &old).map_err(cannot("rename", &self.folder))?;
        } else {
            // The one before it is the newest whole one, and stays until this one is in its place.
            remove_if_there(&self.folder)?;
        }
        fs::rename(fresh, &self.folder).map_err(cannot("rename", fresh))?;
        sync(self.folder.parent().unwrap_or(Path::new("")))
    }

    /// Loads the newest whole checkpoint into networks of `make_network` (not clones of one: they would share the
    /// running statistics of batch normalisation) and `optimizer`; `None` when there is none. Returned are the state,
    /// the network, its average and the optimiser.
    ///
    /// # Errors
    /// [`TrainError::Checkpoint`] when a file cannot be read or does not fit,
    /// [`TrainError::CheckpointMismatch`] when it was made with another configuration or seed.
    pub fn load(
        &self,
        make_network: impl Fn() -> Result<Network, TrainError>,
        optimizer: ModuleOptimizer,
        fingerprint: &Fingerprint,
        seed: u64,
    ) -> Result<Option<Saved>, TrainError> {
        let Some((folder, state)) = self.state()? else {
            return Ok(None);
        };
        let bytes = |name: &str| {
            let path = folder.join(name);
            fs::read(&path).map_err(cannot("read", &path))
        };
        let seeds = (state.seed != seed).then(|| "seed".to_owned());
        if let Some(what) = fingerprint.difference(&state.fingerprint).or(seeds) {
            return Err(TrainError::CheckpointMismatch { what, path: folder });
        }
        let load = |name: &str| -> Result<Network, TrainError> {
            let path = folder.join(name);
            let file = bytes(name)?;
            record_files::check_network(&path).map_err(at(&path))?;
            let record = ModuleRecord::from_bytes(Bytes::from_bytes_vec(file));
            let record = record.map_err(at(&path))?;
            let loaded = make_network()?.try_load_record(record);
            loaded.map_err(at(&path))
        };
        let network = load(NETWORK)?;
        let average = folder.join(AVERAGE).is_file().then(|| load(AVERAGE)).transpose()?;
        let optimizer_path = folder.join(OPTIMIZER);
        record_files::check_optimizer(&optimizer_path, &network).map_err(at(&optimizer_path))?;
        let optimizer = optimizer
            .from_bytes(Bytes::from_bytes_vec(bytes(OPTIMIZER)?))
            .map_err(at(&optimizer_path))?;
        Ok(Some(Saved {
            state,
            network,
            average,
            optimizer,
        }))
    }
}

/// What there is of a checkpoint at `folder`: the folder itself, and the checkpoint before it, which is the only one where
/// a training was killed while it saved. A training that does not go on from them overwrites both.
pub fn existing_checkpoints(folder: &Path) -> Vec<PathBuf> {
    let places = CheckpointFolder::new(folder).places();
    places.into_iter().filter(|place| place.exists()).collect()
}

/// Whether the state in `folder` can be read.
fn is_whole(folder: &Path) -> bool {
    fs::read(folder.join(STATE)).is_ok_and(|bytes| serde_json::from_slice::<Checkpoint>(&bytes).is_ok())
}

fn remove_if_there(folder: &Path) -> Result<(), TrainError> {
    if !folder.exists() {
        return Ok(());
    }
    fs::remove_dir_all(folder).map_err(cannot("remove", folder))
}

fn has_finite_weights(network: &Network) -> bool {
    let mut finite = true;
    network.each_weight(|_, values| finite &= values.convert::<f32>().iter::<f32>().all(f32::is_finite));
    finite
}

/// Waits until the names of the files in `folder` are on the disk.
fn sync(folder: &Path) -> Result<(), TrainError> {
    deepsft_formats::sync_folder(folder).map_err(cannot("write", folder))
}

/// Blames what failed on the file at `path`.
fn at<E: Display>(path: &Path) -> impl Fn(E) -> TrainError {
    move |error| TrainError::Checkpoint {
        reason: error.to_string(),
        path: path.to_path_buf(),
    }
}

/// What could not be done with the file or folder at `path`.
fn cannot(action: &str, path: &Path) -> impl Fn(io::Error) -> TrainError {
    move |error| at(path)(format!("cannot {action}: {error}"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use burn::module::Param;
    use burn::tensor::Tensor;

    #[test]
    fn a_checkpoint_that_is_set_aside_is_kept_and_none_is_left_to_go_on_from() {
        let folder = tempfile::tempdir().unwrap();
        let checkpoint = CheckpointFolder::new(folder.path().join("model.checkpoint"));
        assert_eq!(checkpoint.set_aside().unwrap(), None);
        let write = |name: &str, text: &str| {
            let place = folder.path().join(name);
            fs::create_dir_all(&place).unwrap();
            fs::write(place.join(STATE), text).unwrap();
        };
        // Beside the newest lies the one before, or that one alone after a kill.
        for (names, kept, ending) in [
            (
                &["model.checkpoint", "model.checkpoint.old"][..],
                "model.checkpoint",
                "",
            ),
            (&["model.checkpoint.old"], "model.checkpoint.old", "-2"),
            (&["model.checkpoint"], "model.checkpoint", "-3"),
        ] {
            for name in names {
                let state = Checkpoint {
                    seed: name.len() as u64,
                    ..Checkpoint::default()
                };
                write(name, &serde_json::to_string(&state).unwrap());
            }
            let aside = checkpoint.set_aside().unwrap().unwrap();
            assert_eq!(aside, folder.path().join(format!("model.checkpoint.outdated{ending}")));
            let text = fs::read_to_string(aside.join(STATE)).unwrap();
            assert!(text.contains(&format!("\"seed\":{}", kept.len())), "{text}");
            assert_eq!(checkpoint.state().unwrap(), None);
        }
    }

    fn network() -> Network {
        let camera = deepsft_geometry::training_camera();
        Network::new(
            &deepsft::NetworkConfig::compact([297.0, 210.0], &camera),
            &burn::tensor::Device::flex(),
        )
    }

    #[test]
    fn a_damaged_optimiser_is_an_error_that_names_its_file() {
        let folder = tempfile::tempdir().unwrap();
        let place = folder.path().join("model.checkpoint");
        let checkpoint = CheckpointFolder::new(&place);
        let optimizer = || burn::optim::SgdConfig::new().init();
        checkpoint
            .save(&Checkpoint::default(), &network(), None, &optimizer())
            .unwrap();
        // The weights are no state of an optimiser, though the file is whole.
        fs::copy(place.join(NETWORK), place.join(OPTIMIZER)).unwrap();
        let load = checkpoint.load(|| Ok(network()), optimizer(), &Fingerprint::default(), 0);
        let error = load.map(drop).unwrap_err().to_string();
        assert!(
            error.contains("belongs to no weight") && error.contains(OPTIMIZER),
            "{error}"
        );
    }

    #[test]
    fn an_empty_state_does_not_hide_the_checkpoint_before_it() {
        let folder = tempfile::tempdir().unwrap();
        let checkpoint = CheckpointFolder::new(folder.path().join("model.checkpoint"));
        let optimizer = || burn::optim::SgdConfig::new().init();
        let save = |samples| {
            let state = Checkpoint {
                samples,
                ..Checkpoint::default()
            };
            checkpoint.save(&state, &network(), None, &optimizer()).unwrap();
        };
        save(7);
        save(14);
        let state = folder.path().join("model.checkpoint").join(STATE);
        // As a power cut leaves a file that was renamed before it was written.
        fs::write(&state, "").unwrap();
        let load = || checkpoint.load(|| Ok(network()), optimizer(), &Fingerprint::default(), 0);
        assert_eq!(load().unwrap().unwrap().state.samples, 7);
        // The next one takes the place of the broken one, not of the good one.
        save(21);
        let old = folder.path().join("model.checkpoint.old");
        let samples = |folder: &Path| {
            let bytes = fs::read(folder.join(STATE)).unwrap();
            serde_json::from_slice::<Checkpoint>(&bytes).unwrap().samples
        };
        assert_eq!((samples(&old), load().unwrap().unwrap().state.samples), (7, 21));
        fs::write(&state, "").unwrap();
        let aside = checkpoint.set_aside().unwrap().unwrap();
        assert_eq!(samples(&aside), 7);
        assert_eq!(checkpoint.state().unwrap(), None);
        save(28);
        fs::write(&state, "").unwrap();
        assert!(load().err().unwrap().to_string().contains("state.json"));
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
        assert_eq!(checkpoint.state().unwrap().unwrap().1.samples, 7);
    }
}
