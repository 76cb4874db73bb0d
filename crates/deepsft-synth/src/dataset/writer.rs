//! Shards written whole: under another name, brought to the disk and renamed.

use super::description::{DATASET_FILE, DatasetDescription};
use super::entries::{ENTRIES, encode};
use crate::error::SynthError;
use crate::sample::Sample;
use deepsft_formats::{FolderKind, FormatError, StagedFolder, sha256_file};
use deepsft_geometry::Template;
use serde::{Deserialize, Serialize};
use serde_json::Value;
use std::fs;
use std::io::{self, BufWriter, Write};
use std::path::Path;

/// The shard that is being written.
const OPEN_SHARD: &str = "shard.tmp";

/// Samples per shard of a data set that is written at once.
const SHARD_SIZE: usize = 500;

#[derive(Debug, Serialize, Deserialize)]
pub(super) struct FinishedShard {
    pub(super) name: String,
    pub(super) bytes: u64,
    sha256: String,
    pub(super) samples: u64,
}

/// Writes the data set of `samples` of `template`, made with `seed` and the settings `configuration`, to `place`. The first
/// sample that is an error ends it.
///
/// # Errors
/// That of the sample, [`SynthError::DepthRange`] for a depth above 6553.5 mm, and those of [`StagedFolder`].
pub fn write_dataset<E: From<SynthError>>(
    place: &Path,
    template: &Template,
    configuration: Value,
    seed: u64,
    samples: impl Iterator<Item = Result<Sample, E>>,
) -> Result<(), E> {
    let folder = StagedFolder::new(place, &FolderKind::DATASET).map_err(SynthError::from)?;
    let coded = |(index, sample): (u64, Result<Sample, E>)| Ok::<_, E>(encode(seed, index, &sample?)?);
    let mut samples = (0..).zip(samples).map(coded).peekable();
    let mut shards = Vec::new();
    while samples.peek().is_some() {
        shards.push(write_shard(
            folder.path(),
            shards.len(),
            samples.by_ref().take(SHARD_SIZE),
        )?);
    }
    let description = DatasetDescription::new(template, configuration, seed);
    Ok(finish(folder, description, shards)?)
}

/// Writes the shard of this number of the coded `samples` into `folder`. One that fails leaves nothing: it may be the disk that is full.
pub(super) fn write_shard<E: From<SynthError>>(
    folder: &Path,
    number: usize,
    samples: impl Iterator<Item = Result<[Vec<u8>; 4], E>>,
) -> Result<FinishedShard, E> {
    let name = format!("shard-{number:06}.tar");
    let (beside, path) = (folder.join(OPEN_SHARD), folder.join(&name));
    let failed = |error: io::Error| SynthError::from(FormatError::unwritten(&path, error));
    let write = || -> Result<FinishedShard, E> {
        let mut archive = tar::Builder::new(BufWriter::new(fs::File::create(&beside).map_err(failed)?));
        let mut count = 0;
        for sample in samples {
            for (ending, content) in ENTRIES.into_iter().zip(sample?) {
                // Nothing of the machine or the moment goes into the header: equal samples are equal bytes.
                let mut header = tar::Header::new_ustar();
                header.set_size(content.len() as u64);
                header.set_mode(0o644);
                let entry = format!("{count:06}.{ending}");
                archive
                    .append_data(&mut header, entry, content.as_slice())
                    .map_err(failed)?;
            }
            count += 1;
        }
        let synced = || -> io::Result<u64> {
            let mut out = archive.into_inner()?;
            out.flush()?;
            let file = out.into_inner().map_err(io::IntoInnerError::into_error)?;
            file.sync_all()?;
            Ok(file.metadata()?.len())
        };
        let bytes = synced().map_err(failed)?;
        let sha256 = sha256_file(&beside).map_err(SynthError::from)?;
        fs::rename(&beside, &path).map_err(failed)?;
        Ok(FinishedShard {
            name,
            bytes,
            sha256,
            samples: count,
        })
    };
    let written = write();
    if written.is_err() {
        let _ = fs::remove_file(&beside);
    }
    written
}

/// Describes the `shards` in `folder` and puts it in its place.
pub(super) fn finish(
    folder: StagedFolder,
    mut description: DatasetDescription,
    shards: Vec<FinishedShard>,
) -> Result<(), SynthError> {
    for shard in shards {
        description.samples += shard.samples;
        description.shards.push(shard.name);
        description.shard_bytes.push(shard.bytes);
        description.shard_sha256.push(shard.sha256);
    }
    folder.write(DATASET_FILE, description.to_json().as_bytes())?;
    Ok(folder.commit()?)
}
