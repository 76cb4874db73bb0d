//! Where the samples of step 1 come from: made on the fly, or read from data sets.

use crate::error::TrainError;
use deepsft_geometry::{Template, training_camera};
use deepsft_synth::{DatasetDescription, DatasetFolder, IndexedShards, Sample, Synthesizer};
use rayon::prelude::*;
use std::ops::Range;

/// Of a data set one sample in so many is held out, at its end, though no more than
/// [`TrainConfig::held_out_frames`](crate::TrainConfig::held_out_frames). Our choice.
const SAMPLES_PER_HELD_OUT_ONE: u64 = 10;

/// Where a training takes its samples from. Workers ask for them from several threads.
pub trait SampleSource: Send + Sync {
    /// The template that the samples show.
    fn template(&self) -> &Template;

    /// Sample `index` to train on. Samples that are made on the fly depend on `seed`, too.
    ///
    /// # Errors
    /// [`TrainError`] when it cannot be read.
    fn sample(&self, seed: u64, index: u64) -> Result<Sample, TrainError>;

    /// How many samples there are to train on when `held_out_frames` are to be held out, if there are; `None` when they
    /// never end.
    ///
    /// # Errors
    /// [`TrainError::TooFewSamples`] when there are too few to hold one out.
    fn training_samples(&self, held_out_frames: u64) -> Result<Option<u64>, TrainError>;

    /// The samples to measure on, which are never trained on: at most `held_out_frames`. Those that are made on the fly
    /// depend on `seed`, which is not that of the samples to train on.
    ///
    /// # Errors
    /// [`TrainError`] when one cannot be read or there are too few.
    fn held_out(&self, seed: u64, held_out_frames: u64) -> Result<Vec<Sample>, TrainError>;

    /// A text that differs when samples would.
    fn fingerprint(&self) -> String;
}

/// Samples made on the fly: never the same one twice.
impl SampleSource for Synthesizer {
    fn template(&self) -> &Template {
        Self::template(self)
    }

    fn sample(&self, seed: u64, index: u64) -> Result<Sample, TrainError> {
        let sample = Self::sample(self, seed, index);
        self.check_photographs()?;
        Ok(sample)
    }

    fn training_samples(&self, _: u64) -> Result<Option<u64>, TrainError> {
        Ok(None)
    }

    fn held_out(&self, seed: u64, held_out_frames: u64) -> Result<Vec<Sample>, TrainError> {
        let samples = (0..held_out_frames).into_par_iter();
        samples.map(|index| SampleSource::sample(self, seed, index)).collect()
    }

    fn fingerprint(&self) -> String {
        format!("made on the fly {}", Self::fingerprint(self))
    }
}

/// The samples of data sets on disk, one set after the other. The end is held out: the last tenth of all samples, at most as
/// many as asked for.
#[derive(Clone, Debug)]
pub struct StoredSamples {
    template: Template,
    shards: IndexedShards,
    fingerprint: String,
}

impl StoredSamples {
    /// Finds the samples of `sets`, which show `template` and which the training camera must have taken. `found` is told the number of
    /// each shard's.
    ///
    /// # Errors
    /// [`TrainError::RepeatedSample`] when two data sets share some: one might be trained on and held out; and those of
    /// [`IndexedShards::open`].
    pub fn open(sets: &[DatasetFolder], template: &Template, found: impl FnMut(u64)) -> Result<Self, TrainError> {
        let descriptions = || sets.iter().map(DatasetFolder::description);
        for (number, one) in descriptions().enumerate() {
            descriptions()
                .take(number)
                .try_for_each(|other| check_apart(one, other))?;
        }
        // What the samples depend on; not how they are cut into files.
        let fingerprint = descriptions()
            .map(|set| format!("{:?} {} {} {};", identity(set), set.seed, set.first, set.samples))
            .collect();
        let shards = IndexedShards::open(sets, training_camera(), found)?;
        Ok(Self {
            template: template.clone(),
            shards,
            fingerprint,
        })
    }

    /// The numbers of the samples that are held out of at most `held_out_frames`.
    fn held_out_range(&self, held_out_frames: u64) -> Result<Range<u64>, TrainError> {
        let samples = self.shards.samples();
        if samples < SAMPLES_PER_HELD_OUT_ONE {
            return Err(TrainError::TooFewSamples {
                actual: samples,
                expected: SAMPLES_PER_HELD_OUT_ONE,
            });
        }
        let held_out = (samples / SAMPLES_PER_HELD_OUT_ONE).min(held_out_frames);
        Ok(samples - held_out..samples)
    }
}

impl SampleSource for StoredSamples {
    fn template(&self) -> &Template {
        &self.template
    }

    fn sample(&self, _: u64, index: u64) -> Result<Sample, TrainError> {
        Ok(self.shards.sample(index)?)
    }

    fn training_samples(&self, held_out_frames: u64) -> Result<Option<u64>, TrainError> {
        Ok(Some(self.held_out_range(held_out_frames)?.start))
    }

    fn held_out(&self, _: u64, held_out_frames: u64) -> Result<Vec<Sample>, TrainError> {
        let numbers = self.held_out_range(held_out_frames)?;
        let samples = numbers.into_par_iter().map(|number| self.shards.sample(number));
        Ok(samples.collect::<Result<_, _>>()?)
    }

    fn fingerprint(&self) -> String {
        format!("data sets {}", self.fingerprint)
    }
}

/// What the samples of a data set depend on beside seed and index.
fn identity(set: &DatasetDescription) -> [&str; 2] {
    [&set.fingerprint, &set.configuration_fingerprint]
}

/// Refuses two data sets with a sample in common.
fn check_apart(one: &DatasetDescription, other: &DatasetDescription) -> Result<(), TrainError> {
    let indices = |set: &DatasetDescription| set.first..set.first.saturating_add(set.samples);
    let (a, b) = (indices(one), indices(other));
    let index = a.start.max(b.start);
    if identity(one) == identity(other) && one.seed == other.seed && index < a.end.min(b.end) {
        return Err(TrainError::RepeatedSample { seed: one.seed, index });
    }
    Ok(())
}
