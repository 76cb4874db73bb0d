//! `deepsft synth`: a synthetic data set.

use crate::dataset::{self, DATASET_FILE};
use crate::output::atomic::{self, StagedFolder};
use crate::{input, progress, synthesis};
use anyhow::Result;
use clap::Args;
use deepsft_synth::{DatasetDescription, SampleRecord};
use std::path::PathBuf;
use std::time::Instant;

#[derive(Args)]
#[command(after_help = "\
Writes DIR/dataset.json and tar shards in the WebDataset layout. A shard holds for each sample
  NNNNNN.rgb.png    the image
  NNNNNN.depth.png  16-bit, tenths of a millimetre, 0 where the object is not seen
  NNNNNN.uv.png     16-bit, u and v in red and green, 65535 is 1
  NNNNNN.json       camera, seed, index, light, the mesh in camera coordinates

The same template, seed and index give the same sample on every machine, so jobs can share a large set:
  deepsft synth --template cover --count 10000 --seed 5 --first 0 --out part0
  deepsft synth --template cover --count 10000 --seed 5 --first 10000 --out part1")]
pub struct SynthArguments {
    /// Folder of the template
    #[arg(long, value_name = "DIR")]
    template: PathBuf,
    /// Number of samples
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..))]
    count: u64,
    /// Seed of the data set
    #[arg(long, value_name = "S")]
    seed: u64,
    /// Folder to write; an older data set there is replaced
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Index of the first sample
    #[arg(long, value_name = "INDEX", default_value_t = 0)]
    first: u64,
    /// Samples a shard
    #[arg(long, value_name = "N", default_value_t = 500, value_parser = clap::value_parser!(u64).range(1..))]
    shard_size: u64,
    /// Photographs (PNG or JPEG) to use as backgrounds beside the drawn ones
    #[arg(long, value_name = "DIR")]
    backgrounds: Option<PathBuf>,
}

pub fn run(arguments: &SynthArguments) -> Result<()> {
    let SynthArguments { count, seed, first, .. } = *arguments;
    let template = input::template(&arguments.template)?;
    let folder = StagedFolder::new(&arguments.out, &[DATASET_FILE])?;
    let synthesizer = synthesis::synthesizer(&template, arguments.backgrounds.as_deref())?;
    let config = synthesizer.config().clone();
    let start = Instant::now();
    let bar = progress::counting(count, "samples");
    let indices = first..first.saturating_add(count);
    let samples = synthesis::samples(synthesizer, seed, indices.clone());
    let records = indices
        .zip(samples)
        .map(|(index, sample)| SampleRecord { seed, index, sample });
    let shards = dataset::write_shards(&folder, records.inspect(|_| bar.inc(1)), arguments.shard_size)?;
    bar.finish_and_clear();
    let description = DatasetDescription::new(&template, &config, seed, count, shards);
    atomic::write_file(&folder.path().join(DATASET_FILE), description.to_json()?.as_bytes())?;
    folder.commit()?;
    let rate = count as f64 / start.elapsed().as_secs_f64();
    println!("{count} samples, {rate:.1} a second: {}", arguments.out.display());
    Ok(())
}
