//! A data set in the making: finished shards in a folder beside its place, so that an interrupted `deepsft synth` goes on.
//!
//! `DIR.partial` holds whole shards and `state.json`, which says what they are the beginning of. After each shard
//! the state is replaced by a rename. Whatever moment the process is killed at, what the state lists is whole. At the end the folder comes to its place.

use super::description::DatasetDescription;
use super::entries::encode;
use super::part::DatasetPart;
use super::writer::{FinishedShard, finish, write_shard};
use crate::error::SynthError;
use crate::in_order::in_order;
use crate::scene::Synthesizer;
use deepsft_formats::{FolderKind, FormatError, StagedFolder};
use serde::{Deserialize, Serialize};
use std::fs;
use std::io;
use std::ops::Range;
use std::path::Path;

/// What is made, in the folder.
const STATE_FILE: &str = "state.json";

/// Everything that the shards' bytes depend on.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct DatasetPlan {
    seed: u64,
    first: u64,
    samples: u64,
    shard_size: u64,
    fingerprint: String,
}

impl DatasetPlan {
    /// The samples `indices` of `seed`, at most `shard_size` of them in a file.
    pub fn new(synthesizer: &Synthesizer, seed: u64, indices: Range<u64>, shard_size: u64) -> Self {
        Self {
            seed,
            first: indices.start,
            samples: indices.end - indices.start,
            shard_size,
            fingerprint: synthesizer.fingerprint(),
        }
    }

    /// Number of samples.
    pub fn samples(&self) -> u64 {
        self.samples
    }

    /// Whether a data set is the one that is planned, up to how it is cut into files.
    pub fn is_of(&self, description: &DatasetDescription) -> bool {
        (
            description.seed,
            description.first,
            description.samples,
            &description.fingerprint,
        ) == (self.seed, self.first, self.samples, &self.fingerprint)
    }
}

#[derive(Debug, Serialize, Deserialize)]
struct State {
    plan: DatasetPlan,
    shards: Vec<FinishedShard>,
}

/// A data set in the making, and the folder beside its place that holds what there is of it.
#[derive(Debug)]
pub struct UnfinishedDataset {
    folder: StagedFolder,
    state: State,
}

impl UnfinishedDataset {
    /// Begins the data set that is to stand at `place`, or goes on with what is there of it.
    ///
    /// # Errors
    /// [`SynthError::Refused`] when the beginning of another one is there; of the folders [`FormatError::Locked`] when
    /// another process makes it, [`FormatError::ForeignFolder`], [`FormatError::File`] and [`FormatError::Write`].
    pub fn open(place: &Path, plan: DatasetPlan) -> Result<Self, SynthError> {
        let folder = StagedFolder::resume(place, &FolderKind::DATASET, &[STATE_FILE])?;
        let path = folder.path().join(STATE_FILE);
        let mut shards = Vec::new();
        if path.exists() {
            let read = || -> io::Result<State> { Ok(serde_json::from_slice(&fs::read(&path)?)?) };
            let found =
                read().map_err(|error| FormatError::unreadable(&path, format!("could not read it: {error}")))?;
            if found.plan != plan {
                let (folder, difference) = (folder.path().display(), difference(&found.plan, &plan));
                return Err(SynthError::Refused(format!(
                    "{folder} holds the beginning of another data set ({difference}): ask for that one, or remove it"
                )));
            }
            let whole = |shard: &FinishedShard| {
                let file = fs::metadata(folder.path().join(&shard.name));
                file.is_ok_and(|file| file.is_file() && file.len() == shard.bytes)
            };
            // A shard somebody took away is made again, and all after it.
            shards = found.shards.into_iter().take_while(whole).collect();
        }
        let state = State { plan, shards };
        let unfinished = Self { folder, state };
        unfinished.save()?;
        Ok(unfinished)
    }

    /// Makes the missing samples on all cores and puts the data set in its place. An older one there is replaced. `part` says
    /// which of several it is. `made` is called after each sample.
    ///
    /// # Errors
    /// Of a sample, or [`FormatError::Write`]; shards finished until then stay.
    pub fn make(
        mut self,
        synthesizer: &Synthesizer,
        part: Option<DatasetPart>,
        mut made: impl FnMut(),
    ) -> Result<(), SynthError> {
        let plan = self.state.plan.clone();
        while self.finished() < plan.samples {
            let first = plan.first + self.finished();
            let end = first.saturating_add(plan.shard_size).min(plan.first + plan.samples);
            let samples = in_order(first..end, |index| {
                let sample = synthesizer.sample(plan.seed, index);
                synthesizer.check_photographs()?;
                encode(plan.seed, index, &sample)
            });
            let number = self.state.shards.len();
            let shard = write_shard(self.folder.path(), number, samples.inspect(|_| made()))?;
            self.state.shards.push(shard);
            self.save()?;
        }
        let configuration = synthesizer.config().description();
        let mut description = DatasetDescription::new(synthesizer.template(), configuration, plan.seed);
        description.first = plan.first;
        description.part = part.map(|part| (part.number(), part.of()));
        description.fingerprint = plan.fingerprint;
        finish(self.folder, description, self.state.shards)
    }

    /// Samples in finished shards.
    pub fn finished(&self) -> u64 {
        self.state.shards.iter().map(|shard| shard.samples).sum()
    }

    fn save(&self) -> Result<(), FormatError> {
        // Numbers, texts and fixed keys: there is nothing in it that JSON could not say.
        self.folder
            .write(STATE_FILE, &serde_json::to_vec(&self.state).unwrap_or_default())
    }
}

/// In what two plans differ, for people.
fn difference(found: &DatasetPlan, asked: &DatasetPlan) -> String {
    for (what, found, asked) in [
        ("seed", found.seed, asked.seed),
        ("first sample", found.first, asked.first),
        ("number of samples", found.samples, asked.samples),
        ("shard size", found.shard_size, asked.shard_size),
    ] {
        if found != asked {
            return format!("{what} {found}, not {asked}");
        }
    }
    "of another template, preset or set of photographs".to_owned()
}
