//! Data sets as folders: `dataset.json` and its tar shards.

use super::{
    DatasetDescription, DatasetPart, EdgeLengthHistogram, EdgeLengthSummary, Sample, SampleRecord, ShapeCounts,
    ShardReader, write_shard,
};
use crate::error::FormatError;
use crate::fingerprint::sha256_file;
use crate::folder::unfinished_folder;
use deepsft_geometry::Camera;
use std::error::Error;
use std::fs;
use std::io::{BufReader, BufWriter};
use std::path::{Path, PathBuf};
use std::sync::mpsc::{SyncSender, sync_channel};

/// Name of the description in a data set's folder.
pub const DATASET_FILE: &str = "dataset.json";

/// What an error calls a data set, and a shard.
const DATA_SET: &str = "data set";
const SHARD: &str = "shard";

/// Samples that are read ahead.
const AHEAD: usize = 8;

/// Why something cannot be used, before its name is known.
type Reason = Box<dyn Error + Send + Sync>;

/// A data set of the disk.
///
/// Every error is a [`FormatError::Unusable`] with the description's file, the shard or the folder.
#[derive(Clone, Debug, PartialEq)]
pub struct DatasetFolder {
    path: PathBuf,
    description: DatasetDescription,
}

impl DatasetFolder {
    /// Reads and checks the description of the data set in `folder`. One that was made in parts is put together, and all
    /// of them have to be there.
    ///
    /// # Errors
    /// [`FormatError::Unusable`] when there is no whole data set.
    pub fn open(folder: &Path) -> Result<Self, FormatError> {
        let unusable = |reason: Reason| FormatError::unusable(DATA_SET, folder, reason);
        let description = match (folder.join(DATASET_FILE).exists(), dataset_parts(folder)) {
            (false, Some(of)) => merged(folder, of).map_err(unusable)?,
            (false, None) if unfinished_folder(folder).is_dir() => {
                let what_there_is = unfinished_folder(folder);
                let reason = format!(
                    "it is not finished, what there is of it is in {}: give `deepsft synth` the same command again",
                    what_there_is.display()
                );
                return Err(unusable(reason.into()));
            }
            _ => description_in(folder)?,
        };
        Ok(Self {
            path: folder.to_path_buf(),
            description,
        })
    }

    /// The content of `dataset.json`, of a data set in parts that of all.
    pub fn description(&self) -> &DatasetDescription {
        &self.description
    }

    /// Checks that the shards are there and, where the description says how large they are, whole.
    ///
    /// # Errors
    /// [`FormatError::Unusable`] with the first shard that is not.
    pub fn check_shards(&self) -> Result<(), FormatError> {
        for (number, path) in self.shards().enumerate() {
            let wrong = match (fs::metadata(&path), self.description.shard_bytes.get(number)) {
                (Err(error), _) => error.to_string(),
                (Ok(file), Some(&bytes)) if bytes != file.len() => {
                    format!("it has {} bytes and should have {bytes}", file.len())
                }
                _ => continue,
            };
            let reason = format!("{wrong}; put it back, or remove the data set to make it anew");
            return Err(FormatError::unusable(SHARD, &path, reason));
        }
        Ok(())
    }

    /// Checks the content of all shards by their hashes: that takes as long as reading them. `checked` is called after each.
    ///
    /// # Errors
    /// [`FormatError::Unusable`] with the first shard that is not the one described.
    pub fn check_hashes(&self, mut checked: impl FnMut()) -> Result<(), FormatError> {
        self.shards().enumerate().try_for_each(|(number, path)| {
            check_hash(&path, &self.description, number)
                .map_err(|reason| FormatError::unusable(SHARD, &path, reason))?;
            checked();
            Ok(())
        })
    }

    /// The samples of all shards in order, read ahead by a thread.
    ///
    /// # Errors
    /// [`FormatError::Unusable`] for samples of another camera than `camera`, other samples or fewer than described and
    /// shards with another hash; after an error there are no more.
    pub fn samples(&self, camera: Camera) -> impl Iterator<Item = Result<Sample, FormatError>> + use<> {
        let (sender, receiver) = sync_channel(AHEAD);
        let set = self.clone();
        std::thread::spawn(move || {
            if let Err(error) = set.send(&camera, &sender) {
                // Nobody listens when the reader has had enough: then nothing is lost either.
                let _ = sender.send(Err(error));
            }
        });
        receiver.into_iter()
    }

    /// Paths of the shards, in order.
    fn shards(&self) -> impl Iterator<Item = PathBuf> + '_ {
        self.description.shards.iter().map(|name| self.path.join(name))
    }

    fn send(&self, camera: &Camera, sender: &SyncSender<Result<Sample, FormatError>>) -> Result<(), FormatError> {
        let (mut count, expected) = (0, self.description.samples);
        for (number, path) in self.shards().enumerate() {
            let next = self.description.first.saturating_add(count);
            count += check_hash(&path, &self.description, number)
                .and_then(|()| send_shard(&path, camera, (self.description.seed, next), sender))
                .map_err(|reason| FormatError::unusable(SHARD, &path, reason))?;
        }
        if count != expected {
            let reason = format!("its shards hold {count} samples, its description says {expected}");
            return Err(FormatError::unusable(DATA_SET, &self.path, reason));
        }
        Ok(())
    }
}

/// Writes shards of at most `shard_size` records each into `folder`; gives their names.
///
/// # Errors
/// [`FormatError::Write`] with the shard that could not be written.
pub fn write_shards(
    folder: &Path,
    records: impl Iterator<Item = SampleRecord>,
    shard_size: u64,
) -> Result<Vec<String>, FormatError> {
    let mut shards = Vec::new();
    let mut records = records.peekable();
    while records.peek().is_some() {
        let name = format!("shard-{:06}.tar", shards.len());
        let path = folder.join(&name);
        let some = records.by_ref().take(shard_size as usize);
        let written = fs::File::create(&path)
            .map_err(FormatError::from)
            .and_then(|file| write_shard(BufWriter::new(file), some));
        written.map_err(|error| FormatError::unwritten(&path, error))?;
        shards.push(name);
    }
    Ok(shards)
}

/// The number of parts of which there is any in `folder`; of several numbers the largest.
pub fn dataset_parts(folder: &Path) -> Option<u64> {
    let names = fs::read_dir(folder)
        .ok()?
        .filter_map(|entry| entry.ok()?.file_name().into_string().ok());
    let of = |name: String| -> Option<u64> { name.strip_prefix("part-")?.split_once("-of-")?.1.parse().ok() };
    names.filter_map(of).max()
}

/// The description of a data set of `of` parts.
fn merged(folder: &Path, of: u64) -> Result<DatasetDescription, Reason> {
    let mut whole: Option<DatasetDescription> = None;
    let mut changes = EdgeLengthHistogram::default();
    let mut shapes = Some(ShapeCounts::default());
    for number in 1..=of {
        let name = DatasetPart::new(number, of)?.folder_name();
        if !folder.join(&name).join(DATASET_FILE).exists() {
            return Err(format!("{name} is not there yet").into());
        }
        let mut description = description_in(&folder.join(&name))?;
        for shard in &mut description.shards {
            *shard = format!("{name}/{shard}");
        }
        if let Some(summary) = &description.edge_length_change {
            changes.add(&summary.histogram);
        }
        if description.samples > 0 {
            shapes = shapes.zip(description.handle_shapes).map(|(mut sum, counts)| {
                sum.add(&counts);
                sum
            });
        }
        match &mut whole {
            None => whole = Some(description),
            Some(whole) => {
                let follows = Some(description.first) == whole.first.checked_add(whole.samples);
                let samples = whole.samples.checked_add(description.samples);
                let samples = samples.ok_or("its parts say that they have more samples than can be counted")?;
                if (&description.fingerprint, description.seed) != (&whole.fingerprint, whole.seed) || !follows {
                    return Err(format!("{name} is part of another data set than those before it").into());
                }
                whole.samples = samples;
                whole.shards.append(&mut description.shards);
                whole.shard_bytes.append(&mut description.shard_bytes);
                whole.shard_sha256.append(&mut description.shard_sha256);
            }
        }
    }
    let mut whole = whole.ok_or("it has no parts")?;
    if whole.shard_bytes.len() != whole.shards.len() {
        // A part that does not say how large its shards are: nothing is known in order.
        whole.shard_bytes.clear();
    }
    if whole.shard_sha256.len() != whole.shards.len() {
        whole.shard_sha256.clear();
    }
    whole.part = None;
    whole.edge_length_change = Some(EdgeLengthSummary::new(changes));
    // A part that does not say them: of the whole they are not known either.
    whole.handle_shapes = shapes.filter(|shapes| shapes.shapes > 0);
    Ok(whole)
}

/// Checks that the shard `number` of a data set is the one that was described, as far as the description says.
fn check_hash(path: &Path, description: &DatasetDescription, number: usize) -> Result<(), Reason> {
    match description.shard_sha256.get(number) {
        Some(expected) if sha256_file(path)? != *expected => {
            Err("it is not the shard that was written: its SHA-256 differs from the described one".into())
        }
        _ => Ok(()),
    }
}

/// Reads and checks the description in `folder`.
fn description_in(folder: &Path) -> Result<DatasetDescription, FormatError> {
    let path = folder.join(DATASET_FILE);
    let read = || -> Result<DatasetDescription, Reason> {
        let description = DatasetDescription::from_json(&fs::read_to_string(&path)?)?;
        if let Some(name) = description.shards.iter().find(|name| name.contains(['/', '\\'])) {
            return Err(format!("it names a shard outside of its folder: {name:?}").into());
        }
        Ok(description)
    };
    read().map_err(|reason| FormatError::unusable(DATA_SET, &path, reason))
}

/// Sends the samples of a shard, which are those of a seed from an index on; gives their number.
fn send_shard(
    path: &Path,
    camera: &Camera,
    (seed, first): (u64, u64),
    sender: &SyncSender<Result<Sample, FormatError>>,
) -> Result<u64, Reason> {
    let mut reader = ShardReader::new(BufReader::new(fs::File::open(path)?));
    let mut count = 0;
    for record in reader.records()? {
        let record = record?;
        record.check_described(seed, first.saturating_add(count))?;
        let SampleRecord { index, sample, .. } = record;
        if sample.camera != *camera {
            return Err(format!("sample {index} was taken by another camera than the one expected").into());
        }
        count += 1;
        if sender.send(Ok(sample)).is_err() {
            break;
        }
    }
    Ok(count)
}
