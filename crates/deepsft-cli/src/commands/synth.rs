//! `deepsft synth`: a synthetic data set.

use crate::failure::usage;
use crate::output::{panels, sheet};
use crate::synthesis::SynthesisOptions;
use crate::{input, progress, synthesis};
use anyhow::{Result, bail};
use clap::Args;
use deepsft::encode_png;
use deepsft_formats::read_template;
use deepsft_synth::{
    DATASET_FILE, DatasetFolder, DatasetPart, DatasetPlan, Sample, Synthesizer, UnfinishedDataset, dataset_parts,
};
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::time::Instant;

/// Samples that the sheet shows.
const ON_SHEET: u64 = 12;

#[derive(Args)]
#[command(after_help = "\
The command writes DIR/dataset.json and tar shards in the WebDataset layout. A shard holds for each sample
  NNNNNN.rgb.png    the image
  NNNNNN.depth.png  16-bit, tenths of a millimetre, 0 where the object is not seen
  NNNNNN.uv.png     16-bit, u and v in red and green, 65535 is 1
  NNNNNN.json       camera, seed, index, light, the mesh in camera coordinates

Finished shards stay in DIR.partial until all are there. The command resumes after any interruption and makes no finished
shard again.

The same template, options, seed and index give the same sample: on one machine bit for bit. On other machines the last
bits may differ, as libraries of elementary functions do. Jobs can therefore divide a large set. Each job writes its own
part into the same folder; commands read the folder as one data set once all parts are there:
  deepsft synth --template cover --count 60000 --seed 5 --images paper --shard 1/4 --out cover-data
  ...
  deepsft synth --template cover --count 60000 --seed 5 --images paper --shard 4/4 --out cover-data
  deepsft eval --model cover-model --data cover-data")]
pub struct SynthArguments {
    /// Folder of the template
    #[arg(long, value_name = "DIR")]
    template: PathBuf,
    /// Number of samples, of all parts together
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..))]
    count: u64,
    /// Seed of the data set
    #[arg(long, value_name = "S")]
    seed: u64,
    /// Folder to write; an older data set there is replaced
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Make only part I of N (1/N to N/N), in the folder part-I-of-N of DIR
    #[arg(long, value_name = "I/N")]
    shard: Option<DatasetPart>,
    /// Index of the first sample
    #[arg(long, value_name = "INDEX", default_value_t = 0)]
    first: u64,
    /// Samples per tar file
    #[arg(long, value_name = "N", default_value_t = 500, value_parser = clap::value_parser!(u64).range(1..))]
    shard_size: u64,
    #[command(flatten)]
    images: SynthesisOptions,
    /// Also draw the first samples on one sheet, each beside its truth
    #[arg(long, value_name = "FILE.png")]
    sheet: Option<PathBuf>,
}

pub fn run(arguments: &SynthArguments) -> Result<()> {
    let Some(end) = arguments.first.checked_add(arguments.count) else {
        let (first, count) = (arguments.first, arguments.count);
        return Err(usage(format!(
            "--count {count} samples from --first {first} on pass the last index, {}",
            u64::MAX
        )));
    };
    let template = read_template(&arguments.template)?;
    let synthesizer = synthesis::synthesizer(&template, &arguments.images)?;
    let seed = arguments.seed;
    if let Some(part) = arguments.shard {
        check_parts(&arguments.out, part)?;
    }
    let (indices, place) = match arguments.shard {
        Some(part) => (
            part.indices(arguments.first, arguments.count),
            arguments.out.join(part.folder_name()),
        ),
        None => (arguments.first..end, arguments.out.clone()),
    };
    let plan = DatasetPlan::new(&synthesizer, seed, indices.clone(), arguments.shard_size);
    if let Some(path) = &arguments.sheet {
        let shown = indices.start..indices.end.min(indices.start.saturating_add(ON_SHEET));
        let samples: Vec<Sample> =
            deepsft_synth::samples(synthesizer.clone(), seed, shown.clone()).collect::<Result<_, _>>()?;
        // A part of a small set may have none.
        match sheet::sheet(&sheet_rows(shown, &samples)) {
            Some(sheet) => {
                deepsft_formats::write_file(path, &encode_png(&sheet)?)?;
                println!("{} samples on a sheet: {}", samples.len(), path.display());
            }
            None => println!("this part has no samples: no sheet"),
        }
    }
    match DatasetFolder::open(&place) {
        Ok(there) if plan.is_of(there.description()) => {
            there.check_shards()?;
            input::check_hashes(&[there])?;
            println!("is there already: {}", place.display());
        }
        _ => make(arguments, &synthesizer, plan, &place)?,
    }
    if let Some(part) = arguments.shard {
        match DatasetFolder::open(&arguments.out) {
            Ok(whole) => {
                whole.check_shards()?;
                let (of, samples, out) = (part.of(), whole.description().samples, arguments.out.display());
                println!("all {of} parts are there, {samples} samples: {out}");
            }
            Err(_) => println!("part {} of {}: others are still to be made", part.number(), part.of()),
        }
    }
    Ok(())
}

/// The samples of these indices, two in a row: each beside its depth, all depths on one scale, and its registration.
fn sheet_rows(indices: Range<u64>, samples: &[Sample]) -> Vec<sheet::Row> {
    let seen = samples.iter().filter(|sample| sample.truth.area() > 0);
    let range = seen
        .map(|sample| panels::depth_range(&sample.truth))
        .reduce(|[low, high], [other_low, other_high]| [low.min(other_low), high.max(other_high)])
        .unwrap_or([0.0, 1.0]);
    let shown: Vec<_> = indices.zip(samples).collect();
    let columns = |(index, sample): &(u64, &Sample)| {
        [
            panels::plain(&format!("sample {index}"), &sample.image),
            panels::depth_within("depth", &sample.truth, range),
            panels::coordinate("u", &sample.truth, 0),
            panels::coordinate("v", &sample.truth, 1),
        ]
    };
    let row = |pair: &[_]| sheet::Row::new("", pair.iter().flat_map(columns).map(sheet::Panel::halved));
    shown.chunks(2).map(row).collect()
}

/// Refuses a folder that holds a whole data set or other parts.
fn check_parts(folder: &Path, part: DatasetPart) -> Result<()> {
    if folder.join(DATASET_FILE).exists() {
        bail!(
            "{} holds a whole data set: choose another folder for parts, or remove it",
            folder.display()
        );
    }
    if let Some(of) = dataset_parts(folder).filter(|of| *of != part.of()) {
        let (folder, asked) = (folder.display(), part.of());
        bail!("{folder} holds parts of {of}: choose another folder for parts of {asked}, or remove it");
    }
    Ok(())
}

fn make(arguments: &SynthArguments, synthesizer: &Synthesizer, plan: DatasetPlan, place: &Path) -> Result<()> {
    let samples = plan.samples();
    let set = UnfinishedDataset::open(place, plan)?;
    let begun = set.finished();
    if begun > 0 {
        println!("going on after {begun} samples");
    }
    let start = Instant::now();
    let bar = progress::counting(samples, "samples");
    bar.set_position(begun);
    bar.reset_eta();
    set.make(synthesizer, arguments.shard, || bar.inc(1))?;
    bar.finish_and_clear();
    let made = samples - begun;
    let rate = made as f64 / start.elapsed().as_secs_f64();
    println!("{made} samples, {rate:.1} per second: {}", place.display());
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use deepsft_geometry::{Picture, Template};
    use deepsft_synth::SynthConfig;

    #[test]
    fn a_sheet_has_two_samples_in_a_row_and_one_scale_of_depth() {
        let texture = Picture::from_fn(40, 30, |x, y| [6 * x as u8, 8 * y as u8, 90]);
        let template = Template::thin_shell(texture, 200.0, 150.0).unwrap();
        let synthesizer = Synthesizer::new(&template, SynthConfig::default()).unwrap();
        let samples: Vec<Sample> = deepsft_synth::samples(synthesizer, 3, 5..8)
            .collect::<Result<_, _>>()
            .unwrap();
        let rows = sheet_rows(5..8, &samples);
        let titles = |row: &sheet::Row| row.panels.iter().map(|panel| panel.title.clone()).collect::<Vec<_>>();
        let first = ["sample 5", "depth", "u", "v", "sample 6", "depth", "u", "v"];
        assert_eq!(
            rows.iter().map(titles).collect::<Vec<_>>(),
            [&first[..], &["sample 7", "depth", "u", "v"]]
        );
        let depths = [&rows[0].panels[1], &rows[0].panels[5], &rows[1].panels[1]];
        assert!(depths[0].bar.is_some() && depths.iter().all(|panel| panel.bar == depths[0].bar));
        assert!(sheet::sheet(&sheet_rows(5..5, &[])).is_none());
    }
}
