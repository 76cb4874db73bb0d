//! `deepsft-lab study fit`: how a method's errors grow with what makes a frame hard.

mod disturbance;
mod measurement;
mod outcome;
mod plan;
mod plot;
mod table;

use anyhow::{Context, Result};
use clap::Args;
use deepsft::{DeviceKind, encode_png};
use deepsft_cli::output::{panels, sheet};
use deepsft_cli::{input, progress};
use deepsft_formats::write_file;
use deepsft_geometry::fitting::{FitOptions, FrameFitter};
use deepsft_geometry::glam::DVec2;
use deepsft_geometry::{Maps, Picture};
use measurement::{StudiedFrame, study_fit, study_length};
use outcome::{Outcome, Series};
use plot::study_plot;
use serde::Serialize;
use std::path::PathBuf;
use table::study_table;

/// Frames of each series on the sheet.
const WORST: usize = 2;

/// Ends of the error scales on the sheet, mm.
const DEPTH_SCALE_MM: f64 = 50.0;

#[derive(Args)]
#[command(after_help = "\
Each series varies one thing on synthetic frames and compares the fitted mesh with the maps that the fit starts from:
  initial registration error   the true maps, disturbed by 2 to 16 px (and depth by up to 5 %)
  hidden fraction              0 to 60 % of the visible sheet covered; the maps are the network's of the covered
                               image, or its maps without the cover, cut exactly or with a rim of 5 px left
  blur                         of the lens, 0 to 4 px, from the network's maps and from the truth disturbed by 4 px
  texture contrast             of the print in the image, 100 to 10 %, from both
  focal length                 believed 0 to 10 % too long: depth is then too large by that factor
  mesh                         that the frames are rendered from: as fine as the fitted one, or twice as fine
All frames but those of \"mesh 1\" are rendered from a mesh of twice the resolution of the fitted one.

The table and the plot show medians over the frames in which the object was found. The JSON file has means too:
  {\"series\": [{\"name\", \"unit\", \"start\", \"rows\": [{\"level\", \"frames\", \"found\", \"fallback_fraction\",
    \"start\": {\"median\": {\"rmse_3d_mm\", \"depth_rmse_mm\", \"registration_rmse_px\", ...}, \"mean\": {...}},
    \"fitted\": {...}, ...}]}]}

Example, about a quarter of an hour on one core:
  deepsft-lab study fit --model models/poster-a4 --frames 40 --seed 424242 --json study.json --plot study.png")]
pub struct FitStudyArguments {
    /// Model bundle whose network and template are used
    #[arg(long, value_name = "BUNDLE")]
    model: PathBuf,
    /// Frames per level
    #[arg(long, value_name = "N", default_value_t = 40, value_parser = clap::value_parser!(u64).range(1..))]
    frames: u64,
    /// Seed of the frames; choose one that was not trained on
    #[arg(long, value_name = "S")]
    seed: u64,
    /// Write the figures to this file
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
    /// Draw the curves to this PNG file
    #[arg(long, value_name = "FILE")]
    plot: Option<PathBuf>,
    /// Draw the two worst fits of each series (by registration error) to this PNG file
    #[arg(long, value_name = "FILE")]
    sheet: Option<PathBuf>,
    /// What computes the network: cpu, or webgpu if the program was built with it
    #[arg(long, value_name = "DEVICE", default_value_t = DeviceKind::Cpu)]
    device: DeviceKind,
}

/// The content of the JSON file.
#[derive(Serialize)]
struct Report {
    model: String,
    frames: u64,
    seed: u64,
    series: Vec<Series>,
    deepsft_version: &'static str,
}

pub fn run(arguments: &FitStudyArguments) -> Result<()> {
    let FitStudyArguments { frames, seed, .. } = *arguments;
    let bundle = input::bundle(&arguments.model)?;
    if seed == bundle.card().provenance.seed {
        eprintln!("warning: the model was trained with seed {seed}: these frames are not new to it");
    }
    let (estimator, _) = input::estimator(&bundle, arguments.device)?;
    let mut fitter = FrameFitter::new(bundle.template(), FitOptions::default())?;
    let bar = progress::counting(study_length(frames), "frames");
    let mut worst = Worst::default();
    let each = |frame: &StudiedFrame<'_>| {
        if arguments.sheet.is_some() {
            worst.offer(frame);
        }
        bar.set_message(format!("{}: {} {}", frame.series, frame.level, frame.unit));
        bar.inc(1);
    };
    let series = study_fit(&estimator, &mut fitter, bundle.template(), frames, seed, each)?;
    bar.finish_and_clear();
    println!(
        "{}: {frames} frames per level, seed {seed}; medians before -> after the fit (mean after)",
        bundle.name()
    );
    print!("{}", study_table(&series));
    if let Some(path) = &arguments.plot {
        let plot = study_plot(&series).context("there is nothing to draw")?;
        write_file(path, &encode_png(&plot)?)?;
    }
    if let Some(path) = &arguments.sheet {
        let sheet = sheet::sheet(&worst.rows(bundle.template().size_mm())).context("there is nothing to draw")?;
        write_file(path, &encode_png(&sheet)?)?;
    }
    if let Some(path) = &arguments.json {
        let report = Report {
            model: bundle.name().to_owned(),
            frames,
            seed,
            series,
            deepsft_version: env!("CARGO_PKG_VERSION"),
        };
        write_file(path, &serde_json::to_vec_pretty(&report)?)?;
    }
    Ok(())
}

/// The worst answers of each series, worst first.
#[derive(Default)]
struct Worst {
    series: Vec<(&'static str, Vec<Kept>)>,
}

struct Kept {
    level: f64,
    unit: &'static str,
    index: u64,
    image: Picture,
    truth: Maps,
    start: Maps,
    fitted: Maps,
    outcome: Outcome,
}

impl Worst {
    fn offer(&mut self, frame: &StudiedFrame<'_>) {
        if self.series.last().is_none_or(|(name, _)| *name != frame.series) {
            self.series.push((frame.series, Vec::new()));
        }
        let Some((_, kept)) = self.series.last_mut() else {
            return;
        };
        let at = kept.partition_point(|other| badness(&other.outcome) >= badness(frame.outcome));
        if frame.outcome.found && at < WORST {
            let one = Kept {
                level: frame.level,
                unit: frame.unit,
                index: frame.index,
                image: frame.image.clone(),
                truth: frame.truth.clone(),
                start: frame.start.clone(),
                fitted: frame.fitted.clone(),
                outcome: *frame.outcome,
            };
            kept.insert(at, one);
            kept.truncate(WORST);
        }
    }

    fn rows(&self, size_mm: DVec2) -> Vec<sheet::Row> {
        let row = |(series, kept): (&str, &Kept)| {
            let Kept {
                image,
                truth,
                start,
                fitted,
                outcome,
                ..
            } = kept;
            let figure = |value: Option<f64>| value.map_or_else(|| "-".to_owned(), |value| format!("{value:.2}"));
            let caption = format!(
                "{series}, {} {}, frame {}: registration {} -> {} px, 3D {} -> {} mm, {}",
                kept.level,
                kept.unit,
                kept.index,
                figure(outcome.start.registration_rmse_px),
                figure(outcome.fitted.registration_rmse_px),
                figure(outcome.start.rmse_3d_mm),
                figure(outcome.fitted.rmse_3d_mm),
                match outcome.accepted {
                    Some(true) => "mesh taken",
                    Some(false) => "mesh refused",
                    None => "no mesh",
                },
            );
            let panels = [
                panels::plain("input", image),
                panels::overlay("start", image, start, size_mm),
                panels::overlay("fitted", image, fitted, size_mm),
                panels::overlay("true", image, truth, size_mm),
                panels::depth_error("depth error, start", start, truth, DEPTH_SCALE_MM),
                panels::depth_error("depth error, fitted", fitted, truth, DEPTH_SCALE_MM),
            ];
            let halved = |panel: sheet::Panel| sheet::Panel {
                picture: panel.picture.halved(),
                ..panel
            };
            sheet::Row {
                caption,
                panels: panels.into_iter().map(halved).collect(),
            }
        };
        let all = self
            .series
            .iter()
            .flat_map(|(series, kept)| kept.iter().map(move |kept| (*series, kept)));
        all.map(row).collect()
    }
}

/// The order of the sheet: answers without any pixel first, then by registration error.
fn badness(outcome: &Outcome) -> f64 {
    outcome.fitted.registration_rmse_px.unwrap_or(f64::INFINITY)
}
