//! The data sets that step 1 is trained on: opened and checked before the training begins.

use crate::failure::BlameInput;
use crate::{input, progress};
use anyhow::{Result, anyhow};
use deepsft_formats::{DatasetFolder, FormatError};
use deepsft_geometry::{Template, training_camera};
use deepsft_synth::{CAMERA_FILE, DatasetDescription, IndexedShards};
use deepsft_train::{ACCURACY_SEED, SampleSource, StoredSamples, TrainError};
use std::fmt;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Data sets to train on.
pub struct DataSets {
    pub samples: Arc<StoredSamples>,
    /// Samples to train on, and those held out at the end.
    pub training: u64,
    pub held_out: u64,
    /// Names and seeds of the sets.
    sets: Vec<(String, DatasetDescription)>,
}

impl DataSets {
    /// Opens the data sets of `template` in `folders`; `None` when there are none. At most `held_out_frames` samples are to
    /// be held out.
    pub fn open(folders: &[PathBuf], template: &Template, held_out_frames: u64) -> Result<Option<Self>> {
        let Some(last) = folders.last() else { return Ok(None) };
        let sets: Vec<DatasetFolder> = folders
            .iter()
            .map(|folder| open_one(folder, template))
            .collect::<Result<_>>()?;
        input::check_hashes(&sets)?;
        let sets: Vec<_> = sets.iter().map(|set| set.description().clone()).collect();
        let mut shards = IndexedShards::new(training_camera());
        let bar = progress::counting(sets.iter().map(|set| set.samples).sum(), "samples found");
        for (set, folder) in sets.iter().zip(folders) {
            let before = shards.samples();
            for name in &set.shards {
                let index = set.first + (shards.samples() - before);
                let added = shards.add_described(folder.join(name), set.seed, index);
                let added = added.map_err(TrainError::from);
                bar.inc(blame_shard(added)?);
            }
            let (found, described) = (shards.samples() - before, set.samples);
            if found != described {
                Err(anyhow!(
                    "its shards hold {found} samples, its description says {described}"
                ))
                .blame("data set", folder)?;
            }
        }
        bar.finish_and_clear();
        let all = shards.samples();
        let samples = StoredSamples::new(shards, &sets).blame("data set", last)?;
        let training = samples.training_samples(held_out_frames).blame("data set", last)?;
        let training = training.unwrap_or(all);
        Ok(Some(Self {
            samples: Arc::new(samples),
            training,
            held_out: all - training,
            sets: folders
                .iter()
                .map(|folder| folder.display().to_string())
                .zip(sets)
                .collect(),
        }))
    }
}

/// What they are, for the model's card.
impl fmt::Display for DataSets {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (name, set) in &self.sets {
            write!(f, "data set {name} ({} samples of seed {}), ", set.samples, set.seed)?;
        }
        write!(f, "the last {} held out", self.held_out)
    }
}

/// A data set that is of the template and whole, as far as its files' sizes tell.
fn open_one(folder: &Path, template: &Template) -> Result<DatasetFolder> {
    let refused = |reason: String| Err(anyhow!(reason)).blame("data set", folder);
    if folder.join(CAMERA_FILE).is_file() {
        return refused("it is an RGB-D recording, which steps 2 and 3 train on: --recording".to_owned());
    }
    let set = DatasetFolder::open(folder)?;
    let description = set.description();
    if description.seed == ACCURACY_SEED {
        return refused(format!(
            "its seed {ACCURACY_SEED} is that of the images on which the accuracy of a model is measured"
        ));
    }
    description.check_template(template).blame("data set", folder)?;
    set.check_shards()?;
    Ok(set)
}

/// Lays what is wrong with a shard at its door, also when it is met while training.
pub fn blame_shard<T>(result: Result<T, TrainError>) -> Result<T> {
    match result {
        Err(TrainError::Format(FormatError::File { reason, path })) => Err(anyhow!(reason)).blame("shard", &path),
        other => Ok(other?),
    }
}
