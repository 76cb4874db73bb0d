//! `deepsft-lab study finding`: how often a print is found that nothing was trained for.

mod canvas;
mod dice;
mod finders;
mod judging;
mod line_art;
mod photograph;
mod prints;
mod repetitive;
mod table;

use crate::measuring::write_json;
use crate::reading;
use anyhow::{Result, ensure};
use clap::{Args, ValueEnum};
use deepsft::{SharedDescriptorNetwork, encode_png};
use deepsft_formats::write_file;
use deepsft_geometry::Picture;
use finders::Others;
use indicatif::ProgressBar;
use judging::{FrameResult, Studied};
use prints::{Kind, Print};
use serde::Serialize;
use std::fs;
use std::path::{Path, PathBuf};

/// Prints after which files are written again: what is measured is kept when a long run is ended.
const BETWEEN_WRITES: usize = 5;

#[derive(Args)]
#[command(after_help = "\
Every print is made by a program, of three kinds: like photographs; graphic; text or line art. Repetitive prints are a kind of
their own. A print is 297 mm long, 250 to 900 mm away, tilted by up to 65
degrees, any way up, bent, partly hidden, in images of 960 x 540 pixels. Other frames show another print of the same kind in
its place. Every finder's sheet is taken on by the same fit. Errors are medians over the visible sheet in pixels of the canonical
image (480 x 270).

Example, about an hour on two cores:
  deepsft-lab study finding --seed 424242 --json finding.json --failures failures")]
pub struct FindingStudyArguments {
    /// Kinds of prints, separated by commas
    #[arg(long, value_name = "KINDS", value_delimiter = ',', default_values_t = Kind::value_variants().to_vec())]
    kinds: Vec<Kind>,
    /// Prints of each of the first three kinds
    #[arg(long, value_name = "N", default_value_t = 100)]
    prints: usize,
    /// Repetitive prints
    #[arg(long, value_name = "N", default_value_t = 20)]
    repetitive: usize,
    /// Study the template of this model in place of painted prints, and its own network beside the other finders
    #[arg(long, value_name = "DIR", conflicts_with_all = ["kinds", "prints", "repetitive"])]
    model: Option<PathBuf>,
    /// Frames per print
    #[arg(long, value_name = "N", default_value_t = 5, value_parser = clap::value_parser!(u64).range(1..))]
    frames: u64,
    /// Frames per print that show another one
    #[arg(long, value_name = "N", default_value_t = 4)]
    absent: u64,
    /// Seed of prints and frames
    #[arg(long, value_name = "S")]
    seed: u64,
    /// Weights of the network that describes any picture (models/any-picture/weights.bpk): a finder too
    #[arg(long, value_name = "FILE")]
    descriptors: Option<PathBuf>,
    /// Write the figures of every frame to this file
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
    /// Write the frames that no finder solved into this folder, and their prints
    #[arg(long, value_name = "DIR")]
    failures: Option<PathBuf>,
}

/// The content of the JSON file.
#[derive(Serialize)]
struct Report<'a> {
    prints: usize,
    seed: u64,
    frames: &'a [FrameResult],
    deepsft_version: &'static str,
}

pub fn run(arguments: &FindingStudyArguments) -> Result<()> {
    let model = arguments.model.as_deref().map(reading::bundle).transpose()?;
    let prints = match &model {
        Some(bundle) => prints::prints_of_model(bundle.template(), arguments.seed)?,
        None => painted_prints(arguments)?,
    };
    let count = if model.is_some() { 1 } else { prints.len() };
    ensure!(
        prints.len() > 1,
        "at least two prints are needed: one is shown in the other's place"
    );
    let descriptors = arguments.descriptors.as_ref().map(fs::read).transpose()?;
    let others = Others {
        network: model.as_ref().map(reading::estimator).transpose()?,
        descriptors: descriptors
            .map(|weights| SharedDescriptorNetwork::from_bytes(&weights))
            .transpose()?,
    };
    let progress = ProgressBar::new(count as u64);
    let mut results = Vec::new();
    for number in 0..count {
        let mut studied = Studied::new(&prints, number, &others)?;
        let seed = arguments.seed.wrapping_add(number as u64);
        for index in 0..arguments.frames.max(arguments.absent) {
            for (shown, count) in [(true, arguments.frames), (false, arguments.absent)] {
                if index < count {
                    let (result, image) = studied.frame(seed, index, shown)?;
                    if let (Some(folder), true) = (&arguments.failures, result.is_failure()) {
                        write_failure(folder, &result, &image, prints[number].template.texture())?;
                    }
                    results.push(result);
                }
            }
        }
        progress.inc(1);
        if number % BETWEEN_WRITES == BETWEEN_WRITES - 1 || number + 1 == count {
            let report = Report {
                prints: prints.len(),
                seed: arguments.seed,
                frames: &results,
                deepsft_version: env!("CARGO_PKG_VERSION"),
            };
            write_json(arguments.json.as_deref(), &report)?;
        }
    }
    table::print(&results);
    Ok(())
}

fn painted_prints(arguments: &FindingStudyArguments) -> Result<Vec<Print>> {
    let counts: Vec<(Kind, usize)> = (arguments.kinds.iter())
        .map(|&kind| match kind {
            Kind::Repetitive => (kind, arguments.repetitive),
            _ => (kind, arguments.prints),
        })
        .collect();
    prints::prints(&counts, arguments.seed)
}

/// Writes a frame, and once its print.
fn write_failure(folder: &Path, result: &FrameResult, image: &Picture, print: &Picture) -> Result<()> {
    fs::create_dir_all(folder)?;
    let of = format!("{}-{}", result.kind, result.print);
    let what = if result.shown { "not-fitted" } else { "false-find" };
    write_file(&folder.join(format!("{of}.png")), &encode_png(print)?)?;
    let frame = format!("{of}-{}-{what}.png", result.index);
    Ok(write_file(&folder.join(frame), &encode_png(image)?)?)
}
