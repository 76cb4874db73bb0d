//! Shards read in any order: where each sample lies is found once, the samples are read when they are asked for.

use super::entries::{ENTRIES, decode};
use super::folder::{DatasetFolder, check_hash};
use super::{DATA_SET, Reason, SHARD};
use crate::sample::Sample;
use deepsft_formats::{FormatError, guarded, read_error};
use deepsft_geometry::Camera;
use std::fs::File;
use std::io::{Read, Seek, SeekFrom};
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::mpsc::sync_channel;

/// Largest entry that is read, bytes: a 16-bit RGB map of 4096 x 2160 uncompressed.
const LARGEST_ENTRY: u64 = 64 << 20;

/// Samples of a data set that are read ahead.
const AHEAD: usize = 8;

/// Where the entries of a sample lie in its shard.
type Places = [Range<u64>; 4];

/// The samples of data sets by their number, one set after the other. Kept are positions alone, 64 bytes a sample: a set may
/// be larger than memory. Threads may read at once.
#[derive(Clone, Debug)]
pub struct IndexedShards {
    camera: Camera,
    shards: Vec<IndexedShard>,
}

#[derive(Clone, Debug)]
struct IndexedShard {
    path: PathBuf,
    /// Number of its first sample.
    first: u64,
    /// Seed of its samples and index of the first, as they are described.
    described: (u64, u64),
    samples: Vec<Places>,
}

impl IndexedShards {
    /// Finds the samples of `sets`, which `camera` must have taken. Names and sizes of all entries are checked; the first sample
    /// of each shard is read. `found` is told the number of a shard's samples.
    ///
    /// # Errors
    /// [`FormatError::Unusable`] with the shard that cannot be read, is cut or holds what is no sample, or whose first sample
    /// is not the one described or was taken by another camera; with the data set that has more or fewer samples than
    /// described.
    pub fn open(sets: &[DatasetFolder], camera: Camera, mut found: impl FnMut(u64)) -> Result<Self, FormatError> {
        let shards = Vec::new();
        let mut index = Self { camera, shards };
        for set in sets {
            let (before, description) = (index.samples(), set.description());
            for path in set.shards() {
                let first = index.samples();
                let described = (description.seed, description.first.saturating_add(first - before));
                let samples = guarded(|| places(&path)).unwrap_or_else(|error| Err(error.into()));
                let samples = samples.map_err(|error| FormatError::unusable(SHARD, &path, error))?;
                found(samples.len() as u64);
                let has_samples = !samples.is_empty();
                index.shards.push(IndexedShard {
                    path,
                    first,
                    described,
                    samples,
                });
                if has_samples {
                    index.sample(first)?;
                }
            }
            let (found, expected) = (index.samples() - before, description.samples);
            if found != expected {
                let reason = format!("its shards hold {found} samples, its description says {expected}");
                return Err(FormatError::unusable(DATA_SET, set.path(), reason));
            }
        }
        Ok(index)
    }

    /// Samples of all shards.
    pub fn samples(&self) -> u64 {
        self.shards
            .last()
            .map_or(0, |last| last.first + last.samples.len() as u64)
    }

    /// Reads sample `number`, counted from 0 over all data sets.
    ///
    /// # Errors
    /// [`FormatError::Unusable`] when there is none, when its shard can no longer be read, or when it cannot be decoded, is not the
    /// one described or was taken by another camera.
    pub fn sample(&self, number: u64) -> Result<Sample, FormatError> {
        let after = self.shards.partition_point(|shard| shard.first <= number);
        let read = |shard: &IndexedShard| -> Result<Sample, Reason> {
            let within = number - shard.first;
            let places = usize::try_from(within)
                .ok()
                .and_then(|within| shard.samples.get(within));
            let places = places.ok_or_else(|| format!("there is no sample {number}, only {}", self.samples()))?;
            let (seed, index, sample) =
                decode(&contents(&shard.path, places)?).map_err(|reason| format!("sample {within:06}: {reason}"))?;
            let (expected_seed, first) = shard.described;
            let expected = first.saturating_add(within);
            if (seed, index) != (expected_seed, expected) {
                let described = format!("sample {expected} of seed {expected_seed}");
                return Err(format!("it holds sample {index} of seed {seed}, its description says {described}").into());
            }
            if sample.camera != self.camera {
                return Err(format!("sample {index} was taken by another camera than the one expected").into());
            }
            Ok(sample)
        };
        let shard = self.shards[..after].last();
        let read = shard.map_or_else(|| Err("there are no samples".into()), read);
        let path = shard.map_or(Path::new(""), |shard| &shard.path);
        read.map_err(|reason| FormatError::unusable(SHARD, path, reason))
    }
}

impl DatasetFolder {
    /// The samples of all shards in order, read ahead by a thread. Each shard's hash is checked before its first sample.
    ///
    /// # Errors
    /// Those of [`IndexedShards::open`]; items are those of [`IndexedShards::sample`] and [`DatasetFolder::check_hashes`], and
    /// after an error there are no more.
    pub fn samples(
        &self,
        camera: Camera,
    ) -> Result<impl Iterator<Item = Result<Sample, FormatError>> + use<>, FormatError> {
        let shards = IndexedShards::open(std::slice::from_ref(self), camera, |_| ())?;
        let hashes = self.description().shard_sha256.clone();
        let (sender, receiver) = sync_channel(AHEAD);
        std::thread::spawn(move || {
            for number in 0..shards.samples() {
                let mut begun = (shards.shards.iter().zip(&hashes)).filter(|(shard, _)| shard.first == number);
                let checked = begun.try_for_each(|(shard, expected)| check_hash(&shard.path, expected));
                let sample = checked.and_then(|()| shards.sample(number));
                let failed = sample.is_err();
                // Nobody listens when the reader has had enough.
                if sender.send(sample).is_err() || failed {
                    break;
                }
            }
        });
        Ok(receiver.into_iter())
    }
}

/// Where the samples of the shard at `path` lie.
fn places(path: &Path) -> Result<Vec<Places>, Reason> {
    let file = File::open(path).map_err(read_error)?;
    let length = file.metadata()?.len();
    let mut archive = tar::Archive::new(file);
    let mut samples: Vec<(String, [Option<Range<u64>>; 4])> = Vec::new();
    for entry in archive.entries_with_seek()? {
        let entry = entry?;
        let name = String::from_utf8_lossy(&entry.path_bytes()).into_owned();
        let known = name.split_once('.').and_then(|(key, ending)| {
            let number = ENTRIES.iter().position(|known| *known == ending)?;
            let numbered = !key.is_empty() && key.bytes().all(|byte| byte.is_ascii_digit());
            (numbered && entry.header().entry_type().is_file()).then_some((key, number))
        });
        let Some((key, number)) = known else {
            return Err(format!("its entry {name} is not NNNNNN.rgb.png, .depth.png, .uv.png or .json").into());
        };
        let (start, size) = (entry.raw_file_position(), entry.size());
        if size > LARGEST_ENTRY {
            return Err(format!("its entry {name} has {size} bytes, expected at most {LARGEST_ENTRY}").into());
        }
        let actual = length.saturating_sub(start);
        if actual < size {
            return Err(format!(
                "its entry {name} has {actual} bytes, expected {size}: it was cut short, copy it again"
            )
            .into());
        }
        if samples.last().is_none_or(|(last, _)| last != key) {
            samples.push((key.to_owned(), [const { None }; 4]));
        }
        let sample = samples.last_mut().map(|(_, places)| &mut places[number]);
        if sample.and_then(|place| place.replace(start..start + size)).is_some() {
            return Err(format!("its entry {name} is there twice").into());
        }
    }
    let whole = |(key, places): (String, [Option<Range<u64>>; 4])| -> Result<Places, Reason> {
        let missing = ENTRIES.iter().zip(&places).find(|(_, place)| place.is_none());
        match missing {
            Some((ending, _)) => Err(format!("its sample {key} has no {ending}").into()),
            None => Ok(places.map(Option::unwrap_or_default)),
        }
    };
    samples.into_iter().map(whole).collect()
}

fn contents(path: &Path, places: &Places) -> Result<[Vec<u8>; 4], Reason> {
    let mut file = File::open(path).map_err(read_error)?;
    let mut contents = [const { Vec::new() }; 4];
    for (content, place) in contents.iter_mut().zip(places) {
        content.resize((place.end - place.start) as usize, 0);
        file.seek(SeekFrom::Start(place.start))?;
        file.read_exact(content)?;
    }
    Ok(contents)
}
