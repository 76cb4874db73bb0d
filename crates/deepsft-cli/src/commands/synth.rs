//! `deepsft synth`: a synthetic data set.

use crate::dataset;
use crate::failure::usage;
use crate::output::{atomic, contact_sheet};
use crate::synthesis::SynthesisOptions;
use crate::unfinished_dataset::{CountedSample, Plan, UnfinishedDataset};
use crate::{input, progress, synthesis};
use anyhow::{Result, bail};
use clap::Args;
use deepsft::encode_png;
use deepsft_synth::{DatasetDescription, EdgeLengthSummary, SampleRecord, Synthesizer};
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::str::FromStr;
use std::time::Instant;

#[derive(Args)]
#[command(after_help = "\
The command writes DIR/dataset.json and tar shards in the WebDataset layout. A shard holds for each sample
  NNNNNN.rgb.png    the image
  NNNNNN.depth.png  16-bit, tenths of a millimetre, 0 where the object is not seen
  NNNNNN.uv.png     16-bit, u and v in red and green, 65535 is 1
  NNNNNN.json       camera, seed, index, light, the mesh in camera coordinates
dataset.json says how isometric the deformations are: median and 95th percentile of the relative change of the mesh's edge
lengths, over all samples. For a template that is no sheet it also counts the shapes that had to be weakened.

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
    shard: Option<Part>,
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

/// Part `number` of `of`, from 1.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Part {
    number: u64,
    of: u64,
}

impl FromStr for Part {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let numbers = text.split_once('/').map(|(number, of)| (number.parse(), of.parse()));
        match numbers {
            Some((Ok(number), Ok(of))) if (1..=of).contains(&number) => Ok(Self { number, of }),
            _ => Err("expected I/N with I from 1 to N, like 2/8".to_owned()),
        }
    }
}

impl Part {
    /// The part's indices among `count` samples from `first` on; parts differ by one sample at most.
    fn indices(self, first: u64, count: u64) -> Range<u64> {
        let end = |number: u64| first + (u128::from(count) * u128::from(number) / u128::from(self.of)) as u64;
        end(self.number - 1)..end(self.number)
    }
}

pub fn run(arguments: &SynthArguments) -> Result<()> {
    let Some(end) = arguments.first.checked_add(arguments.count) else {
        let (first, count) = (arguments.first, arguments.count);
        return Err(usage(format!(
            "--count {count} samples from --first {first} on pass the last index, {}",
            u64::MAX
        )));
    };
    let template = input::template(&arguments.template)?;
    let synthesizer = synthesis::synthesizer(&template, &arguments.images)?;
    let seed = arguments.seed;
    if let Some(part) = arguments.shard {
        check_parts(&arguments.out, part)?;
    }
    let (indices, place) = match arguments.shard {
        Some(part) => (
            part.indices(arguments.first, arguments.count),
            arguments.out.join(dataset::part_name(part.number, part.of)),
        ),
        None => (arguments.first..end, arguments.out.clone()),
    };
    let plan = Plan {
        seed,
        first: indices.start,
        samples: indices.end - indices.start,
        shard_size: arguments.shard_size,
        fingerprint: synthesizer.fingerprint(),
    };
    if let Some(path) = &arguments.sheet {
        let some: Vec<_> = deepsft_synth::samples(synthesizer.clone(), seed, indices.clone())
            .take(contact_sheet::SAMPLES)
            .collect::<Result<_, _>>()?;
        atomic::write_file(path, &encode_png(&contact_sheet::draw(&some))?)?;
        println!("{} samples on a sheet: {}", some.len(), path.display());
    }
    match dataset::open(&place) {
        Ok(there) if is_planned(&there, &plan) => {
            dataset::check_shards(&place, &there)?;
            dataset::check_hashes(&place, &there)?;
            println!("is there already: {}", place.display());
        }
        _ => make(arguments, &synthesizer, plan, &place)?,
    }
    let description = dataset::open(&place)?;
    print_deformations(&description);
    if let Some(part) = arguments.shard {
        match dataset::open(&arguments.out) {
            Ok(whole) => {
                dataset::check_shards(&arguments.out, &whole)?;
                println!(
                    "all {} parts are there, {} samples: {}",
                    part.of,
                    whole.samples,
                    arguments.out.display()
                );
                print_deformations(&whole);
            }
            Err(_) => println!("these figures are of part {} of {} only", part.number, part.of),
        }
    }
    Ok(())
}

/// Refuses a folder that holds a whole data set or other parts.
fn check_parts(folder: &Path, part: Part) -> Result<()> {
    if folder.join(dataset::DATASET_FILE).exists() {
        bail!(
            "{} holds a whole data set: choose another folder for parts, or remove it",
            folder.display()
        );
    }
    match dataset::parts(folder) {
        Some(of) if of != part.of => {
            bail!(
                "{} holds parts of {of}: choose another folder for parts of {}, or remove it",
                folder.display(),
                part.of
            )
        }
        _ => Ok(()),
    }
}

/// Whether a data set is the one that is planned, up to how it is cut into files.
fn is_planned(there: &DatasetDescription, plan: &Plan) -> bool {
    (there.seed, there.first, there.samples, &there.fingerprint)
        == (plan.seed, plan.first, plan.samples, &plan.fingerprint)
}

fn make(arguments: &SynthArguments, synthesizer: &Synthesizer, plan: Plan, place: &Path) -> Result<()> {
    let seed = plan.seed;
    let mut set = UnfinishedDataset::open(place, plan.clone())?;
    let begun = set.finished();
    if begun > 0 {
        println!("going on after {begun} samples");
    }
    let start = Instant::now();
    let bar = progress::counting(plan.samples, "samples");
    bar.set_position(begun);
    bar.reset_eta();
    while set.finished() < plan.samples {
        let first = plan.first + set.finished();
        let end = first.saturating_add(plan.shard_size).min(plan.first + plan.samples);
        let samples = deepsft_synth::in_order(first..end, |index| {
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
        });
        set.write_shard(samples.inspect(|_| bar.inc(1)))?;
    }
    bar.finish_and_clear();
    let mut description = DatasetDescription::new(
        synthesizer.template(),
        synthesizer.config().description(),
        seed,
        plan.samples,
        set.shards(),
    );
    description.shard_bytes = set.shard_bytes();
    description.shard_sha256 = set.shard_sha256();
    description.first = plan.first;
    description.part = arguments.shard.map(|part| (part.number, part.of));
    description.fingerprint = plan.fingerprint;
    description.edge_length_change = Some(EdgeLengthSummary::new(set.edge_lengths()));
    description.handle_shapes = set.handle_shapes();
    set.finish(&description)?;
    let made = plan.samples - begun;
    let rate = made as f64 / start.elapsed().as_secs_f64();
    println!("{made} samples, {rate:.1} a second: {}", place.display());
    Ok(())
}

fn print_deformations(description: &DatasetDescription) {
    if let Some(change) = &description.edge_length_change {
        println!(
            "edge lengths change by {:.2} % (median) and {:.2} % (95th percentile) over {} samples with the object",
            100.0 * change.median,
            100.0 * change.p95,
            change.histogram.samples
        );
    }
    if let Some(shapes) = &description.handle_shapes
        && shapes.weakened + shapes.at_rest > 0
    {
        println!(
            "of {} shapes {} were made weaker than drawn and {} left at rest, to keep the lengths of edges",
            shapes.shapes, shapes.weakened, shapes.at_rest
        );
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_are_all_of_it_once() {
        for (count, of) in [(10, 3), (2, 4), (60_000, 7), (u64::MAX / 2, 5)] {
            let mut next = 11;
            for number in 1..=of {
                let indices = Part { number, of }.indices(11, count);
                assert_eq!(indices.start, next);
                assert!((indices.end - indices.start).abs_diff(count / of) <= 1);
                next = indices.end;
            }
            assert_eq!(next, 11 + count);
        }
    }

    #[test]
    fn parts_are_counted_from_one() {
        assert_eq!("2/8".parse(), Ok(Part { number: 2, of: 8 }));
        for text in ["0/4", "5/4", "1/0", "1", "a/b", "-1/2", "1/2/3"] {
            assert!(text.parse::<Part>().is_err(), "{text}");
        }
    }
}
