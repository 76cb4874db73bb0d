//! Data sets as folders: `dataset.json` and its tar shards.

use super::description::{DATASET_FILE, DatasetDescription};
use super::part::{DatasetPart, dataset_parts};
use super::{DATA_SET, Reason, SHARD};
use deepsft_formats::{FormatError, read_error, sha256_file, unfinished_folder};
use std::fs;
use std::path::{Path, PathBuf};

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
        let unfinished = unfinished_folder(folder);
        let description = match (folder.join(DATASET_FILE).exists(), dataset_parts(folder)) {
            (false, Some(of)) => merged(folder, of).map_err(unusable)?,
            (false, None) if unfinished.is_dir() => {
                let reason = format!(
                    "it is not finished, what there is of it is in {}: give `deepsft synth` the same command again",
                    unfinished.display()
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

    pub(super) fn path(&self) -> &Path {
        &self.path
    }

    /// The content of `dataset.json`, of a data set in parts that of all.
    pub fn description(&self) -> &DatasetDescription {
        &self.description
    }

    pub(super) fn shards(&self) -> impl Iterator<Item = PathBuf> + '_ {
        self.description.shards.iter().map(|name| self.path.join(name))
    }

    /// Checks that the shards are there and, where the description says how large they are, whole.
    ///
    /// # Errors
    /// [`FormatError::Unusable`] with the first shard that is not.
    pub fn check_shards(&self) -> Result<(), FormatError> {
        for (number, path) in self.shards().enumerate() {
            let wrong = match (fs::metadata(&path), self.description.shard_bytes.get(number)) {
                (Err(error), _) => read_error(error).to_string(),
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

    /// Checks the content of all shards by their hashes, as far as the description has them: that takes as long as reading
    /// them. `checked` is called after each.
    ///
    /// # Errors
    /// [`FormatError::Unusable`] with the first shard that is not the one described.
    pub fn check_hashes(&self, mut checked: impl FnMut()) -> Result<(), FormatError> {
        (self.shards().zip(&self.description.shard_sha256)).try_for_each(|(path, expected)| {
            check_hash(&path, expected)?;
            checked();
            Ok(())
        })
    }
}

pub(super) fn check_hash(path: &Path, expected: &str) -> Result<(), FormatError> {
    let reason = match sha256_file(path) {
        Ok(hash) if hash == expected => return Ok(()),
        Ok(_) => {
            "it is not the shard that was written: its SHA-256 differs from the described one, copy it again".to_owned()
        }
        Err(error) => error.to_string(),
    };
    Err(FormatError::unusable(SHARD, path, reason))
}

/// The description of a data set of `of` parts.
fn merged(folder: &Path, of: u64) -> Result<DatasetDescription, Reason> {
    let mut whole: Option<DatasetDescription> = None;
    for part in DatasetPart::all(of) {
        let name = part.folder_name();
        if !folder.join(&name).join(DATASET_FILE).exists() {
            return Err(format!("{name} is not there yet: make it with the same command and its --shard").into());
        }
        let mut part = description_in(&folder.join(&name))?;
        part.shards
            .iter_mut()
            .for_each(|shard| *shard = format!("{name}/{shard}"));
        part.part = None;
        match &mut whole {
            None => whole = Some(part),
            Some(whole) => whole.append(part).map_err(|reason| format!("{name}: {reason}"))?,
        }
    }
    let mut whole = whole.ok_or("it has no parts")?;
    // A part that does not say how large its shards are: nothing is known in order.
    if whole.shard_bytes.len() != whole.shards.len() {
        whole.shard_bytes.clear();
    }
    if whole.shard_sha256.len() != whole.shards.len() {
        whole.shard_sha256.clear();
    }
    Ok(whole)
}

fn description_in(folder: &Path) -> Result<DatasetDescription, FormatError> {
    let path = folder.join(DATASET_FILE);
    let read = || -> Result<_, Reason> { DatasetDescription::from_json(&fs::read(&path).map_err(read_error)?) };
    read().map_err(|reason| FormatError::unusable(DATA_SET, &path, reason))
}
