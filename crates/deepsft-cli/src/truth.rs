//! The truth of synthetic frames: a data set in a folder beside them.

use anyhow::Result;
use deepsft_formats::{DATASET_FILE, FolderKind, StagedFolder, write_file, write_shards};
use deepsft_geometry::Template;
use deepsft_synth::{DatasetDescription, Sample, SampleRecord, TRUTH_FOLDER};
use serde_json::Value;
use std::path::Path;

/// Samples per shard.
const SHARD_SIZE: u64 = 500;

/// Writes the data set of `samples` of `template`, made with `seed` and the settings `configuration`, into the folder of
/// the truth in `folder`. The first sample that is an error ends it.
pub fn write_truth(
    folder: &Path,
    template: &Template,
    configuration: Value,
    seed: u64,
    samples: impl Iterator<Item = Result<Sample>>,
) -> Result<()> {
    let truth = StagedFolder::new(&folder.join(TRUTH_FOLDER), &FolderKind::DATASET)?;
    let (mut count, mut failure) = (0, None);
    let records = samples
        .map_while(|sample| sample.map_err(|error| failure = Some(error)).ok())
        .map(|sample| {
            let index = count;
            count += 1;
            SampleRecord { seed, index, sample }
        });
    let shards = write_shards(truth.path(), records, SHARD_SIZE)?;
    if let Some(error) = failure {
        return Err(error);
    }
    let description = DatasetDescription::new(template, configuration, seed, count, shards);
    write_file(&truth.path().join(DATASET_FILE), description.to_json()?.as_bytes())?;
    Ok(truth.commit()?)
}
