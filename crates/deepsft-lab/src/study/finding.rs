//! `deepsft-lab study finding`: how often a print is found that nothing was trained for, by our finders and by OpenCV's.

mod figures;
mod finders;
mod growth;
mod judging;
mod line_art;
mod opencv;
mod photograph;
mod prints;
mod repetitive;
mod table;

use anyhow::{Result, ensure};
use clap::Args;
use deepsft::{DeviceKind, Estimator, encode_png, start_device};
use deepsft_cli::input;
use deepsft_cli::object_choice::DescriptorChoice;
use deepsft_cli::progress;
use deepsft_formats::write_file;
use figures::{Failures, print_sheets};
use finders::{FeatureFinding, Finder, NetworkFinding};
use growth::Growth;
use judging::{FrameResult, Studied};
use opencv::{Method, OpenCv};
use prints::{Kind, Print};
use serde::Serialize;
use std::fs;
use std::path::PathBuf;

/// Prints after which files are written again: what is measured is kept when a long run is ended.
const BETWEEN_WRITES: usize = 5;

#[derive(Args)]
#[command(after_help = "\
Every print is made by a program, of three kinds: like photographs; graphic; text or line art. Repetitive prints, and your
photographs if you name a folder, are kinds of their own. A print is 297 mm long, 250 to 900 mm away, tilted by up to 65
degrees, any way up, bent, partly hidden, in images of 960 x 540 pixels. Other frames show another print of the same kind in
its place. Every finder's sheet is taken on by the same fit. Errors are medians over the visible sheet in pixels of the canonical
image (480 x 270).

--opencv names a Python with the packages of crates/xtask/bench/requirements-finding.txt, and adds OpenCV's ORB and SIFT: on the
same frames, with the same mesh and the same fit.

Example, an hour and a half on two cores:
  python3 -m venv opencv && opencv/bin/pip install -r crates/xtask/bench/requirements-finding.txt
  deepsft-lab study finding --seed 424242 --opencv opencv/bin/python --json finding.json --figures finding")]
pub struct FindingStudyArguments {
    /// Kinds of prints, separated by commas
    #[arg(long, value_name = "KINDS", value_delimiter = ',', default_values_t = Kind::PAINTED)]
    kinds: Vec<Kind>,
    /// Prints of each of the first three kinds
    #[arg(long, value_name = "N", default_value_t = 100)]
    prints: usize,
    /// Repetitive prints
    #[arg(long, value_name = "N", default_value_t = 20)]
    repetitive: usize,
    /// Study the template of this model in place of painted prints, and its own network beside the other finders
    #[arg(long, value_name = "DIR", conflicts_with_all = ["kinds", "prints", "repetitive", "photographs"])]
    model: Option<PathBuf>,
    /// Folder of photographs (PNG or JPEG); each is a print too
    #[arg(long, value_name = "DIR")]
    photographs: Option<PathBuf>,
    /// Frames per print
    #[arg(long, value_name = "N", default_value_t = 5, value_parser = clap::value_parser!(u64).range(1..))]
    frames: u64,
    /// Frames per print that show another one
    #[arg(long, value_name = "N", default_value_t = 4)]
    absent: u64,
    /// Seed of prints and frames
    #[arg(long, value_name = "S")]
    seed: u64,
    #[command(flatten)]
    descriptors: DescriptorChoice,
    /// Python with OpenCV: measure its ORB and SIFT too
    #[arg(long, value_name = "PYTHON")]
    opencv: Option<PathBuf>,
    /// Write the figures of every frame to this file
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
    /// Write pictures of the prints and of the frames that none of our finders solved into this folder
    #[arg(long, value_name = "DIR")]
    figures: Option<PathBuf>,
}

/// The content of the JSON file.
#[derive(Serialize)]
struct Report<'a> {
    prints: usize,
    seed: u64,
    growth: &'a Growth,
    frames: &'a [FrameResult],
    deepsft_version: &'static str,
}

pub fn run(arguments: &FindingStudyArguments) -> Result<()> {
    let model = arguments.model.as_deref().map(input::bundle).transpose()?;
    let (prints, count) = match &model {
        Some(bundle) => (prints::prints_of_model(bundle.template(), arguments.seed)?, 1),
        None => {
            let prints = painted_prints(arguments)?;
            let count = prints.len();
            (prints, count)
        }
    };
    ensure!(
        prints.len() > 1,
        "at least two prints are needed: one is shown in the other's place"
    );
    if let Some(folder) = &arguments.figures {
        fs::create_dir_all(folder)?;
        for (name, sheet) in print_sheets(&prints) {
            write_file(&folder.join(name), &encode_png(&sheet)?)?;
        }
    }
    let growth = Growth::measured(&prints, arguments.seed)?;
    growth.print();
    let mut finders: Vec<Box<dyn Finder>> = vec![Box::new(FeatureFinding::default())];
    if let Some(bundle) = &model {
        let (device, _) = pollster::block_on(start_device(DeviceKind::Cpu))?;
        finders.push(Box::new(NetworkFinding::of_model(Estimator::new(bundle, &device)?)));
    }
    if let Some(network) = arguments.descriptors.read()? {
        finders.push(Box::new(NetworkFinding::descriptors(network)));
    }
    if let Some(python) = &arguments.opencv {
        for method in [Method::Orb, Method::Sift] {
            finders.push(Box::new(OpenCv::start(python, method)?));
        }
    }
    let bar = progress::counting(count as u64, "prints");
    let mut results = Vec::new();
    let mut failures = Failures::default();
    for number in 0..count {
        let mut studied = Studied::new(&prints, number, &mut finders)?;
        let seed = arguments.seed.wrapping_add(number as u64);
        for index in 0..arguments.frames.max(arguments.absent) {
            for (shown, count) in [(true, arguments.frames), (false, arguments.absent)] {
                if index < count {
                    let (result, image) = studied.frame(seed, index, shown)?;
                    failures.note(&result, &image);
                    results.push(result);
                }
            }
        }
        bar.inc(1);
        if number % BETWEEN_WRITES == BETWEEN_WRITES - 1 || number + 1 == count {
            write(arguments, &prints, &growth, &results, &failures)?;
        }
    }
    bar.finish_and_clear();
    table::print(&results);
    Ok(())
}

/// The prints of all kinds that are asked for.
fn painted_prints(arguments: &FindingStudyArguments) -> Result<Vec<Print>> {
    let counts: Vec<(Kind, usize)> = (arguments.kinds.iter())
        .map(|&kind| match kind {
            Kind::Repetitive => (kind, arguments.repetitive),
            _ => (kind, arguments.prints),
        })
        .collect();
    prints::prints(&counts, arguments.photographs.as_deref(), arguments.seed)
}

/// Writes what is known so far.
fn write(
    arguments: &FindingStudyArguments,
    prints: &[Print],
    growth: &Growth,
    frames: &[FrameResult],
    failures: &Failures,
) -> Result<()> {
    if let Some(folder) = &arguments.figures {
        write_file(&folder.join("failures.png"), &encode_png(&failures.sheet(prints))?)?;
    }
    if let Some(path) = &arguments.json {
        let report = Report {
            prints: prints.len(),
            seed: arguments.seed,
            growth,
            frames,
            deepsft_version: env!("CARGO_PKG_VERSION"),
        };
        write_file(path, &serde_json::to_vec_pretty(&report)?)?;
    }
    Ok(())
}
