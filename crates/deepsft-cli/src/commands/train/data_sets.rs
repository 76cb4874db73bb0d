//! The data sets that step 1 is trained on: opened and checked before the training begins.

use crate::failure::BlameInput;
use crate::{input, progress};
use anyhow::{Result, anyhow};
use deepsft_geometry::Template;
use deepsft_synth::{CAMERA_FILE, DatasetFolder};
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
    sets: String,
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
        let all = sets.iter().map(|set| set.description().samples).sum();
        let bar = progress::counting(all, "samples found");
        let samples = match StoredSamples::open(&sets, template, |found| bar.inc(found)) {
            Err(error @ TrainError::RepeatedSample { .. }) => Err(error).blame("data set", last)?,
            samples => samples?,
        };
        bar.finish_and_clear();
        let training = samples.training_samples(held_out_frames).blame("data set", last)?;
        let training = training.unwrap_or(all);
        let described = folders.iter().zip(&sets).map(|(folder, set)| {
            let description = set.description();
            let (samples, seed) = (description.samples, description.seed);
            format!("data set {} ({samples} samples of seed {seed}), ", folder.display())
        });
        Ok(Some(Self {
            samples: Arc::new(samples),
            training,
            held_out: all - training,
            sets: described.collect(),
        }))
    }
}

/// What they are, for the model's card.
impl fmt::Display for DataSets {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}the last {} held out", self.sets, self.held_out)
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
