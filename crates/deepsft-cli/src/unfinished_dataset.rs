//! A data set in the making: finished shards in a folder beside its place, so that an interrupted `deepsft synth` goes on.
//!
//! `DIR.partial` holds whole shards and `state.json`, which says what they are the beginning of. A shard is written
//! under another name, brought to the disk and renamed; then the state is replaced in the same way. Whatever moment the
//! process is killed at, what the state lists is whole. At the end the folder is renamed to its place.

use crate::dataset::{self, DATASET_FILE};
use crate::output::atomic::{self, FolderKind, FolderLock};
use anyhow::{Context, Result, bail};
use deepsft_formats::sha256_file;
use deepsft_synth::{DatasetDescription, EdgeLengthHistogram, EncodedSample, HandleShapeCounts, ShardWriter};
use serde::{Deserialize, Serialize};
use std::fs;
use std::io::BufWriter;
use std::path::{Path, PathBuf};

/// What is made, in the folder.
const STATE_FILE: &str = "state.json";

/// The shard that is being written.
const OPEN_SHARD: &str = "shard.tmp";

/// A folder in which a data set was begun and nothing finished.
const UNFINISHED: FolderKind = FolderKind {
    known_by: &[OPEN_SHARD],
    files: FolderKind::DATASET.files,
};

/// Everything that the shards' bytes depend on.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Plan {
    pub seed: u64,
    pub first: u64,
    pub samples: u64,
    pub shard_size: u64,
    pub fingerprint: String,
}

#[derive(Serialize, Deserialize)]
struct State {
    plan: Plan,
    shards: Vec<FinishedShard>,
}

#[derive(Serialize, Deserialize)]
struct FinishedShard {
    name: String,
    bytes: u64,
    /// Not known of shards of earlier versions.
    #[serde(default)]
    sha256: String,
    samples: u64,
    edge_lengths: EdgeLengthHistogram,
    /// Not known of shards of programs that did not count them.
    #[serde(default)]
    handle_shapes: Option<HandleShapeCounts>,
}

/// A sample for a shard, and what is counted of it.
pub struct CountedSample {
    pub encoded: EncodedSample,
    /// Changes of the lengths of the mesh's edges; none where the object is not seen.
    pub edge_lengths: Option<Vec<f64>>,
    /// Strength of the shape, where handles made it and it is seen.
    pub handle_strength: Option<f64>,
}

/// The folder beside the place, and what is in it.
pub struct UnfinishedDataset {
    place: PathBuf,
    folder: PathBuf,
    state: State,
    /// Nobody else works on it.
    _alone: FolderLock,
}

impl UnfinishedDataset {
    /// Begins the data set that is to stand at `place`, or goes on with what is there of it.
    pub fn open(place: &Path, plan: Plan) -> Result<Self> {
        atomic::check_folder(place, &FolderKind::DATASET)?;
        let alone = FolderLock::acquire(place)?;
        let folder = dataset::unfinished(place);
        let path = folder.join(STATE_FILE);
        let mut state = State {
            plan: plan.clone(),
            shards: Vec::new(),
        };
        if path.exists() {
            let read = || -> Result<State> { Ok(serde_json::from_slice(&fs::read(&path)?)?) };
            let found = read().with_context(|| format!("could not read {}", path.display()))?;
            if found.plan != plan {
                bail!(
                    "{} holds the beginning of another data set ({}): ask for that one, or remove it",
                    folder.display(),
                    difference(&found.plan, &plan)
                );
            }
            let whole = |shard: &FinishedShard| {
                fs::metadata(folder.join(&shard.name)).is_ok_and(|file| file.is_file() && file.len() == shard.bytes)
            };
            // A shard somebody took away is made again, and all after it.
            state.shards = found.shards.into_iter().take_while(whole).collect();
        } else {
            atomic::check_folder(&folder, &UNFINISHED)?;
            fs::create_dir_all(&folder).with_context(|| format!("could not make {}", folder.display()))?;
        }
        let place = place.to_path_buf();
        let unfinished = Self {
            place,
            folder,
            state,
            _alone: alone,
        };
        unfinished.save()?;
        Ok(unfinished)
    }

    /// Samples in finished shards.
    pub fn finished(&self) -> u64 {
        self.state.shards.iter().map(|shard| shard.samples).sum()
    }

    /// Edge lengths of the finished shards.
    pub fn edge_lengths(&self) -> EdgeLengthHistogram {
        let mut sum = EdgeLengthHistogram::default();
        self.state.shards.iter().for_each(|shard| sum.add(&shard.edge_lengths));
        sum
    }

    /// How strong the shapes of the finished shards are; `None` where handles made none, or it is not known of all.
    pub fn handle_shapes(&self) -> Option<HandleShapeCounts> {
        let mut sum = HandleShapeCounts::default();
        for shard in &self.state.shards {
            sum.add(shard.handle_shapes.as_ref()?);
        }
        (sum.shapes > 0).then_some(sum)
    }

    /// Writes the next shard.
    pub fn write_shard(&mut self, samples: impl Iterator<Item = Result<CountedSample>>) -> Result<()> {
        let name = format!("shard-{:06}.tar", self.state.shards.len());
        let beside = self.folder.join(OPEN_SHARD);
        let mut edge_lengths = EdgeLengthHistogram::default();
        let mut handle_shapes = HandleShapeCounts::default();
        let write = || -> Result<(u64, u64)> {
            let mut shard = ShardWriter::new(BufWriter::new(fs::File::create(&beside)?));
            for sample in samples {
                let sample = sample?;
                shard.append(&sample.encoded)?;
                sample
                    .edge_lengths
                    .into_iter()
                    .for_each(|some| edge_lengths.count(some));
                sample
                    .handle_strength
                    .into_iter()
                    .for_each(|one| handle_shapes.count(one));
            }
            let (count, out) = shard.finish()?;
            let file = out.into_inner().map_err(|error| error.into_error())?;
            file.sync_all()?;
            Ok((count, file.metadata()?.len()))
        };
        let (samples, bytes) = write().with_context(|| format!("could not write {name}"))?;
        let sha256 = sha256_file(&beside)?;
        fs::rename(&beside, self.folder.join(&name)).with_context(|| format!("could not write {name}"))?;
        self.state.shards.push(FinishedShard {
            name,
            bytes,
            sha256,
            samples,
            edge_lengths,
            handle_shapes: Some(handle_shapes),
        });
        self.save()
    }

    /// Names of the finished shards.
    pub fn shards(&self) -> Vec<String> {
        self.state.shards.iter().map(|shard| shard.name.clone()).collect()
    }

    /// Bytes of the finished shards.
    pub fn shard_bytes(&self) -> Vec<u64> {
        self.state.shards.iter().map(|shard| shard.bytes).collect()
    }

    /// SHA-256 of the finished shards; none when it is not known of all.
    pub fn shard_sha256(&self) -> Vec<String> {
        let all: Vec<String> = self.state.shards.iter().map(|shard| shard.sha256.clone()).collect();
        if all.iter().any(String::is_empty) {
            Vec::new()
        } else {
            all
        }
    }

    /// Puts the data set in its place; an older one there is replaced.
    pub fn finish(self, description: &DatasetDescription) -> Result<()> {
        let path = |name: &str| self.folder.join(name);
        atomic::write_file(&path(DATASET_FILE), description.to_json()?.as_bytes())?;
        atomic::replace_folder(&self.folder, &self.place, &FolderKind::DATASET)?;
        let state = self.place.join(STATE_FILE);
        fs::remove_file(&state).with_context(|| format!("could not remove {}", state.display()))
    }

    fn save(&self) -> Result<()> {
        let text = serde_json::to_vec(&self.state)?;
        Ok(atomic::write_file(&self.folder.join(STATE_FILE), &text)?)
    }
}

/// In what two plans differ, for people.
fn difference(found: &Plan, asked: &Plan) -> String {
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
    use crate::synthesis::{self, SynthesisOptions};
    use deepsft_geometry::{Picture, Template};
    use deepsft_synth::{SampleRecord, SynthConfig};

    fn plan(samples: u64) -> Plan {
        Plan {
            seed: 3,
            first: 0,
            samples,
            shard_size: 1,
            fingerprint: "abc".to_owned(),
        }
    }

    fn template() -> Template {
        Template::thin_shell(Picture::from_fn(8, 6, |x, _| [30 * x as u8; 3]), 200.0, 150.0).unwrap()
    }

    fn sample(index: u64) -> Result<CountedSample> {
        let synthesizer = synthesis::synthesizer(&template(), &SynthesisOptions::default())?;
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
        // A shard cut short is not whole, nor is what comes after it.
        fs::write(folder.join("shard-000000.tar"), "cut").unwrap();
        assert_eq!(UnfinishedDataset::open(&place, plan(3)).unwrap().finished(), 0);
        assert!(!place.exists());
    }

    #[test]
    fn a_set_that_is_being_made_is_left_to_the_process_that_makes_it() {
        let above = tempfile::tempdir().unwrap();
        let place = above.path().join("set");
        let set = UnfinishedDataset::open(&place, plan(3)).unwrap();
        let error = UnfinishedDataset::open(&place, plan(3)).err().unwrap();
        assert!(error.to_string().contains("another process"), "{error}");
        drop(set);
        UnfinishedDataset::open(&place, plan(3)).unwrap();
    }

    #[test]
    fn shapes_that_an_older_program_did_not_count_are_not_taken_for_none() {
        let above = tempfile::tempdir().unwrap();
        let place = above.path().join("set");
        let mut set = UnfinishedDataset::open(&place, plan(3)).unwrap();
        set.write_shard([sample(0)].into_iter()).unwrap();
        assert!(set.handle_shapes().is_some());
        let path = above.path().join("set.partial").join(STATE_FILE);
        let mut state: serde_json::Value = serde_json::from_slice(&fs::read(&path).unwrap()).unwrap();
        state["shards"][0].as_object_mut().unwrap().remove("handle_shapes");
        fs::write(&path, state.to_string()).unwrap();
        let mut set = UnfinishedDataset::open(&place, plan(3)).unwrap();
        set.write_shard([sample(1)].into_iter()).unwrap();
        assert_eq!((set.finished(), set.handle_shapes()), (2, None));
    }

    #[test]
    fn a_failed_sample_leaves_the_shards_before_it() {
        let above = tempfile::tempdir().unwrap();
        let place = above.path().join("set");
        let mut set = UnfinishedDataset::open(&place, plan(2)).unwrap();
        set.write_shard([sample(0)].into_iter()).unwrap();
        let failing = [sample(1), Err(anyhow::anyhow!("no memory"))];
        assert!(set.write_shard(failing.into_iter()).is_err());
        assert_eq!(UnfinishedDataset::open(&place, plan(2)).unwrap().finished(), 1);
    }

    #[test]
    fn the_beginning_of_another_set_and_foreign_folders_are_left_alone() {
        let above = tempfile::tempdir().unwrap();
        let place = above.path().join("set");
        drop(UnfinishedDataset::open(&place, plan(3)).unwrap());
        let message = |result: Result<UnfinishedDataset>| crate::failure::message(&result.err().unwrap());
        let other = message(UnfinishedDataset::open(&place, plan(4)));
        assert!(
            other.contains("set.partial") && other.contains("number of samples 3, not 4"),
            "{other}"
        );
        let foreign = above.path().join("mine.partial");
        fs::create_dir(&foreign).unwrap();
        fs::write(foreign.join("thesis.txt"), "").unwrap();
        assert!(message(UnfinishedDataset::open(&above.path().join("mine"), plan(3))).contains("mine.partial"));
    }

    #[test]
    fn a_finished_set_stands_in_its_place_with_nothing_beside_it() {
        let above = tempfile::tempdir().unwrap();
        let place = above.path().join("set");
        let mut set = UnfinishedDataset::open(&place, plan(1)).unwrap();
        set.write_shard([sample(0)].into_iter()).unwrap();
        let shards = set.shards();
        let description = DatasetDescription::new(&template(), SynthConfig::default().description(), 3, 1, shards);
        set.finish(&description).unwrap();
        let names = |folder: &Path| {
            let entries = fs::read_dir(folder).unwrap();
            let mut names: Vec<_> = entries
                .map(|entry| entry.unwrap().file_name().into_string().unwrap())
                .collect();
            names.sort();
            names
        };
        assert_eq!(names(&place), [DATASET_FILE, "shard-000000.tar"]);
        assert_eq!(names(above.path()), ["set"]);
        assert_eq!(dataset::open(&place).unwrap(), description);
    }
}
