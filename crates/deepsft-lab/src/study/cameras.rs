//! `deepsft-lab study cameras`: the same scenes through several cameras (the paper's section on camera intrinsics).

mod scenes;

use crate::measuring::write_json;
use crate::reading;
use anyhow::Result;
use clap::Args;
use deepsft_geometry::Maps;
use deepsft_geometry::fitting::{FrameFitter, Start};
use deepsft_geometry::metrics::{FrameMetrics, Summary, frame_metrics};
use indicatif::ProgressBar;
use scenes::{Scenes, cameras};
use serde::Serialize;
use std::path::PathBuf;

/// Depth of the sheet's centroid, mm: nearer than half a metre hardly any pose is in view of all cameras.
const DISTANCE_MM: [f64; 2] = [400.0, 900.0];

#[derive(Args)]
#[command(after_help = "\
Each scene is rendered once through a wide, fine pinhole. Every camera's image is resampled from it through that camera's lens, and gets
its own noise and compression. A scene counts only if all vertices of the sheet are inside the images of all cameras.

Errors are over the pixels of the canonical image, registration in its pixels.

Example, about half an hour on one core:
  deepsft-lab study cameras --model models/poster-a4 --json cameras.json")]
pub struct CamerasArguments {
    /// Model bundle whose network and template are used
    #[arg(long, value_name = "BUNDLE")]
    model: PathBuf,
    /// Scenes
    #[arg(long, value_name = "N", default_value_t = 100, value_parser = clap::value_parser!(u64).range(1..))]
    scenes: u64,
    /// Seed of the scenes; choose one that was not trained on
    #[arg(long, value_name = "S", default_value_t = 71_100_001)]
    seed: u64,
    /// Write the figures to this file
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
}

/// What was made of one image.
struct Answer {
    found: bool,
    network: FrameMetrics,
    fitted: FrameMetrics,
}

#[derive(Clone, Copy, Serialize)]
struct Figures {
    depth_mm: Figure,
    registration_px: Figure,
    points_mm: Figure,
}

#[derive(Serialize)]
struct Row {
    camera: String,
    scenes: usize,
    found: usize,
    network: Figures,
    fitted: Figures,
}

pub fn run(arguments: &CamerasArguments) -> Result<()> {
    let bundle = reading::bundle(&arguments.model)?;
    let estimator = reading::estimator(&bundle)?;
    let template = bundle.template();
    let mut fitter = FrameFitter::new(template)?;
    let cameras = cameras()?;
    let scenes = Scenes::new(template, &cameras, DISTANCE_MM, arguments.seed)?;
    let mut answers: Vec<Vec<Answer>> = cameras.iter().map(|_| Vec::new()).collect();
    let progress = ProgressBar::new(arguments.scenes);
    for scene in scenes.iter().take(arguments.scenes as usize) {
        let scene = scene?;
        for ((_, camera), answers) in cameras.iter().zip(&mut answers) {
            let canonical = estimator.canonical_camera(camera.size());
            let truth = deepsft_synth::canonical_truth(&scene.world, template.mesh(), &canonical);
            let seen = estimator.canonical_image(&scenes.image(&scene, camera)?, camera)?;
            let maps = pollster::block_on(estimator.infer(&seen, &canonical))?;
            let fit = fitter.fit(&seen, &canonical, &Start::Maps(maps.clone()))?;
            let fitted = fit.as_ref().map(|surface| surface.maps(template.mesh()).within(&maps));
            let errors = |maps: &Maps| frame_metrics(maps, &truth, &canonical, template.size_mm());
            answers.push(Answer {
                found: fit.is_some_and(|surface| surface.verdict.is_found()),
                network: errors(&maps)?,
                fitted: errors(fitted.as_ref().unwrap_or(&maps))?,
            });
        }
        progress.inc(1);
    }
    let rows: Vec<Row> = (cameras.iter().zip(&answers))
        .map(|((name, _), answers)| Row::of(name, answers))
        .collect();
    print(&rows);
    write_json(arguments.json.as_deref(), &rows)
}

impl Row {
    fn of(camera: &str, answers: &[Answer]) -> Self {
        let figure = |of: &dyn Fn(&Answer) -> Option<f64>| -> Figure {
            Summary::of(answers.iter().map(of)).map(|summary| [summary.mean, summary.median])
        };
        let figures = |which: fn(&Answer) -> &FrameMetrics| Figures {
            depth_mm: figure(&|answer| which(answer).depth_rmse_mm),
            registration_px: figure(&|answer| which(answer).registration_rmse_px),
            points_mm: figure(&|answer| which(answer).points_rmse_mm),
        };
        Self {
            camera: camera.to_owned(),
            scenes: answers.len(),
            found: answers.iter().filter(|answer| answer.found).count(),
            network: figures(|answer| &answer.network),
            fitted: figures(|answer| &answer.fitted),
        }
    }
}

/// Mean and median over scenes; `None` without any value.
type Figure = Option<[f64; 2]>;

/// A figure as the tables have it.
fn figure(figure: Figure, decimals: usize) -> String {
    let both = |[mean, median]: [f64; 2]| format!("{mean:.decimals$} / **{median:.decimals$}**");
    figure.map_or_else(|| "-".to_owned(), both)
}

fn print(rows: &[Row]) {
    println!(
        "| | found | network: depth, mm | registration, px | 3D, mm | fitted: depth, mm | registration, px | 3D, mm |"
    );
    println!("|---|---|---|---|---|---|---|---|");
    for row in rows {
        print!("| {} | {} of {}", row.camera, row.found, row.scenes);
        for figures in [row.network, row.fitted] {
            print!(
                " | {} | {} | {}",
                figure(figures.depth_mm, 1),
                figure(figures.registration_px, 2),
                figure(figures.points_mm, 1)
            );
        }
        println!(" |");
    }
}
