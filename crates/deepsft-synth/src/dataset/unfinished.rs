//! A data set in the making: finished shards in a folder beside its place, so that an interrupted `deepsft synth` goes on.
//!
//! `DIR.partial` holds whole shards and `state.json`, which says what they are the beginning of. A shard is written
//! under another name, brought to the disk and renamed; then the state is replaced in the same way. Whatever moment the
//! process is killed at, what the state lists is whole. At the end the folder comes to its place.

use crate::error::SynthError;
use crate::in_order::in_order;
use crate::scene::Synthesizer;
use deepsft_formats::{
    DATASET_FILE, DatasetDescription, DatasetPart, EdgeLengthHistogram, EdgeLengthSummary, EncodedSample, FolderKind,
    FormatError, SampleRecord, ShapeCounts, ShardWriter, StagedFolder, sha256_file,
};
use serde::{Deserialize, Serialize};
use std::fs;
use std::io::{self, BufWriter};
use std::ops::Range;
use std::path::Path;

/// What is made, in the folder.
const STATE_FILE: &str = "state.json";

/// The shard that is being written.
const OPEN_SHARD: &str = "shard.tmp";

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

#[derive(Debug, Serialize, Deserialize)]
struct FinishedShard {
    name: String,
    bytes: u64,
    sha256: String,
    samples: u64,
    edge_lengths: EdgeLengthHistogram,
    handle_shapes: ShapeCounts,
}

/// A sample for a shard, and what is counted of it.
struct CountedSample {
    encoded: EncodedSample,
    /// Changes of the lengths of the mesh's edges; none where the object is not seen.
    edge_lengths: Option<Vec<f64>>,
    /// Strength of the shape, where control points made it and it is seen.
    handle_strength: Option<f64>,
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
    /// [`SynthError::OtherDataset`] when the beginning of another one is there; of the folders [`FormatError::Locked`] when
    /// another process makes it, [`FormatError::ForeignFolder`], [`FormatError::File`] and [`FormatError::Write`].
    pub fn open(place: &Path, plan: DatasetPlan) -> Result<Self, SynthError> {
        let folder = StagedFolder::resume(place, &FolderKind::DATASET, &[STATE_FILE])?;
        let path = folder.path().join(STATE_FILE);
        let mut shards = Vec::new();
        if path.exists() {
            let read = || -> io::Result<State> { Ok(serde_json::from_slice(&fs::read(&path)?)?) };
            let found = read().map_err(|error| FormatError::File {
                reason: format!("could not read it: {error}"),
                path: path.clone(),
            })?;
            if found.plan != plan {
                let difference = difference(&found.plan, &plan);
                let folder = folder.path().to_path_buf();
                return Err(SynthError::OtherDataset { difference, folder });
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
            let samples = in_order(first..end, |index| counted_sample(synthesizer, plan.seed, index));
            self.write_shard(samples.inspect(|_| made()))?;
        }
        let mut description = DatasetDescription::new(
            synthesizer.template(),
            synthesizer.config().description(),
            plan.seed,
            plan.samples,
            self.state.shards.iter().map(|shard| shard.name.clone()).collect(),
        );
        description.shard_bytes = self.state.shards.iter().map(|shard| shard.bytes).collect();
        description.shard_sha256 = self.state.shards.iter().map(|shard| shard.sha256.clone()).collect();
        description.first = plan.first;
        description.part = part.map(|part| (part.number(), part.of()));
        description.fingerprint = plan.fingerprint;
        description.edge_length_change = Some(EdgeLengthSummary::new(self.edge_lengths()));
        description.handle_shapes = self.handle_shapes();
        self.folder.write(DATASET_FILE, description.to_json()?.as_bytes())?;
        Ok(self.folder.commit()?)
    }

    /// Samples in finished shards.
    pub fn finished(&self) -> u64 {
        self.state.shards.iter().map(|shard| shard.samples).sum()
    }

    /// Edge lengths of the finished shards.
    fn edge_lengths(&self) -> EdgeLengthHistogram {
        let mut sum = EdgeLengthHistogram::default();
        self.state.shards.iter().for_each(|shard| sum.add(&shard.edge_lengths));
        sum
    }

    /// How strong the shapes of the finished shards are; `None` where control points made none.
    fn handle_shapes(&self) -> Option<ShapeCounts> {
        let mut sum = ShapeCounts::default();
        self.state.shards.iter().for_each(|shard| sum.add(&shard.handle_shapes));
        (sum.shapes > 0).then_some(sum)
    }

    /// Writes the next shard. One that fails leaves nothing: it may be the disk that is full.
    fn write_shard(
        &mut self,
        samples: impl Iterator<Item = Result<CountedSample, SynthError>>,
    ) -> Result<(), SynthError> {
        let written = self.write_next_shard(samples);
        if written.is_err() {
            let _ = fs::remove_file(self.folder.path().join(OPEN_SHARD));
        }
        written
    }

    fn write_next_shard(
        &mut self,
        samples: impl Iterator<Item = Result<CountedSample, SynthError>>,
    ) -> Result<(), SynthError> {
        let name = format!("shard-{:06}.tar", self.state.shards.len());
        let (beside, path) = (self.folder.path().join(OPEN_SHARD), self.folder.path().join(&name));
        let failed = |error: io::Error| unwritten(&path, &error);
        let failed_in_shard = |error: FormatError| match error {
            FormatError::Io(error) => failed(error),
            other => other,
        };
        let mut edge_lengths = EdgeLengthHistogram::default();
        let mut handle_shapes = ShapeCounts::default();
        let mut shard = ShardWriter::new(BufWriter::new(fs::File::create(&beside).map_err(failed)?));
        for sample in samples {
            let sample = sample?;
            shard.append(&sample.encoded).map_err(failed_in_shard)?;
            if let Some(changes) = sample.edge_lengths {
                edge_lengths.count(changes);
            }
            if let Some(strength) = sample.handle_strength {
                handle_shapes.count(strength);
            }
        }
        let (samples, out) = shard.finish().map_err(failed_in_shard)?;
        let file = out.into_inner().map_err(|error| failed(error.into_error()))?;
        file.sync_all().map_err(failed)?;
        let bytes = file.metadata().map_err(failed)?.len();
        let sha256 = sha256_file(&beside)?;
        fs::rename(&beside, &path).map_err(failed)?;
        self.state.shards.push(FinishedShard {
            name,
            bytes,
            sha256,
            samples,
            edge_lengths,
            handle_shapes,
        });
        self.save()
    }

    fn save(&self) -> Result<(), SynthError> {
        let text = serde_json::to_vec(&self.state);
        let text = text.map_err(|error| unwritten(&self.folder.path().join(STATE_FILE), &error.into()))?;
        Ok(self.folder.write(STATE_FILE, &text)?)
    }
}

/// A sample as it stands in a shard, and what is counted of it.
fn counted_sample(synthesizer: &Synthesizer, seed: u64, index: u64) -> Result<CountedSample, SynthError> {
    let (sample, strength) = synthesizer.sample_and_strength(seed, index);
    synthesizer.check_photographs()?;
    let seen = sample.has_template;
    let edge_lengths = seen.then(|| synthesizer.edge_length_changes(&sample));
    let record = SampleRecord { seed, index, sample };
    Ok(CountedSample {
        encoded: record.encode()?,
        edge_lengths,
        handle_strength: strength.filter(|_| seen),
    })
}

fn unwritten(path: &Path, error: &io::Error) -> FormatError {
    FormatError::Write {
        reason: error.to_string(),
        path: path.to_path_buf(),
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::SynthConfig;
    use deepsft_geometry::{Picture, Template};

    fn plan(samples: u64) -> DatasetPlan {
        DatasetPlan {
            seed: 3,
            first: 0,
            samples,
            shard_size: 1,
            fingerprint: "abc".to_owned(),
        }
    }

    fn sample(index: u64) -> Result<CountedSample, SynthError> {
        let texture = Picture::from_fn(8, 6, |x, _| [30 * x as u8; 3]);
        let synthesizer = Synthesizer::new(&Template::thin_shell(texture, 200.0, 150.0)?, SynthConfig::default())?;
        let sample = synthesizer.sample(3, index);
        let record = SampleRecord { seed: 3, index, sample };
        Ok(CountedSample {
            encoded: record.encode()?,
            edge_lengths: Some(vec![0.01]),
            handle_strength: Some(0.6),
        })
    }

    #[test]
    fn finished_shards_are_found_again_and_a_half_written_one_is_not() {
        let above = tempfile::tempdir().unwrap();
        let place = above.path().join("set");
        let mut set = UnfinishedDataset::open(&place, plan(3)).unwrap();
        set.write_shard([sample(0)].into_iter()).unwrap();
        set.write_shard([sample(1)].into_iter()).unwrap();
        drop(set);
        let folder = above.path().join("set.partial");
        fs::write(folder.join(OPEN_SHARD), "half").unwrap();
        let set = UnfinishedDataset::open(&place, plan(3)).unwrap();
        assert_eq!((set.finished(), set.edge_lengths().samples), (2, 2));
        let shapes = set.handle_shapes().unwrap();
        assert_eq!((shapes.shapes, shapes.weakened, shapes.at_rest), (2, 2, 0));
        drop(set);
        // A shard cut short is not whole, nor is what comes after it.
        fs::write(folder.join("shard-000000.tar"), "cut").unwrap();
        assert_eq!(UnfinishedDataset::open(&place, plan(3)).unwrap().finished(), 0);
        assert!(!place.exists());
    }

    #[test]
    fn a_failed_sample_leaves_the_shards_before_it() {
        let above = tempfile::tempdir().unwrap();
        let place = above.path().join("set");
        let mut set = UnfinishedDataset::open(&place, plan(2)).unwrap();
        set.write_shard([sample(0)].into_iter()).unwrap();
        let failing = [sample(1), Err(SynthError::recording("no memory", Path::new("rgb")))];
        assert!(set.write_shard(failing.into_iter()).is_err());
        assert!(!above.path().join("set.partial").join(OPEN_SHARD).exists());
        drop(set);
        assert_eq!(UnfinishedDataset::open(&place, plan(2)).unwrap().finished(), 1);
    }
}
