//! `deepsft-lab study rolls`: how often an object is found, and how exactly, by how it is rolled before a camera that lies across or
//! stands upright.

use super::frames::{doubled, frames_config};
use crate::measuring::{Spread, write_json};
use crate::reading;
use anyhow::Result;
use clap::Args;
use deepsft::{Device, Target, TargetFinder, View};
use deepsft_geometry::glam::DVec2;
use deepsft_geometry::{Camera, Template, training_camera};
use deepsft_synth::{Sample, SynthConfig, Synthesizer};
use deepsft_train::tracking_errors;
use indicatif::ProgressBar;
use serde::Serialize;
use std::path::PathBuf;

/// Seed of the frames; no training uses it.
const SEED: u64 = 71_000_001;

#[derive(Args)]
pub struct RollsArguments {
    /// Model bundle of the object
    #[arg(long, value_name = "BUNDLE")]
    model: PathBuf,
    /// Steps that a whole turn is divided into
    #[arg(long, value_name = "N", default_value_t = 36, value_parser = clap::value_parser!(u64).range(1..=360))]
    steps: u64,
    /// Frames of each step
    #[arg(long, value_name = "N", default_value_t = 20)]
    frames: u64,
    /// Write the figures to this file
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
}

/// The frames of one step, or of all.
#[derive(Default, Serialize)]
struct Row {
    /// The middle of the step, degrees clockwise; none of all together.
    roll_deg: Option<f64>,
    frames: usize,
    found: usize,
    /// Of the frames in which it was found.
    registration_rmse_px: Option<Spread>,
    points_rmse_mm: Option<Spread>,
}

/// What was said of one frame: of a frame in which the object was found, registration (px) and points (mm).
type Said = Option<(Option<f64>, Option<f64>)>;

#[derive(Serialize)]
struct Camerawise {
    width: usize,
    height: usize,
    all: Row,
    steps: Vec<Row>,
}

/// Renders frames until each step has its share, looks for the object in them, and prints a table for each camera.
pub fn run(arguments: &RollsArguments) -> Result<()> {
    let across = doubled(&training_camera())?;
    let mut tables = Vec::new();
    for camera in [across, across.turned_anticlockwise()] {
        let table = measured(arguments, camera)?;
        print(&table);
        tables.push(table);
    }
    write_json(arguments.json.as_deref(), &tables)
}

fn measured(arguments: &RollsArguments, camera: Camera) -> Result<Camerawise> {
    let target = Target::from_model(&reading::bundle(&arguments.model)?, &Device::Cpu)?;
    let template = target.template().clone();
    let mut finder = TargetFinder::new(target)?;
    let config = SynthConfig {
        camera,
        ..frames_config()?
    };
    let synthesizer = Synthesizer::new(&template, config)?;
    let mut said: Vec<Vec<Said>> = (0..arguments.steps).map(|_| Vec::new()).collect();
    let progress = ProgressBar::new(arguments.steps * arguments.frames);
    for index in 0.. {
        if said.iter().all(|step| step.len() as u64 >= arguments.frames) {
            break;
        }
        let sample = synthesizer.sample(SEED, index);
        if !sample.has_template {
            continue;
        }
        let turns = roll(&template, &sample) / std::f64::consts::TAU;
        let step =
            &mut said[((turns * arguments.steps as f64).round() as i64).rem_euclid(arguments.steps as i64) as usize];
        if step.len() as u64 >= arguments.frames {
            continue;
        }
        step.push(look(&mut finder, &template, &sample)?);
        progress.inc(1);
    }
    let steps = said.iter().enumerate().map(|(k, said)| {
        let roll_deg = Some(k as f64 * 360.0 / arguments.steps as f64);
        Row::of(roll_deg, said.iter().copied())
    });
    Ok(Camerawise {
        width: camera.size().width,
        height: camera.size().height,
        steps: steps.collect(),
        all: Row::of(None, said.iter().flatten().copied()),
    })
}

/// How far the object is rolled: where the u axis of its texture points in the image, radians, clockwise from the right.
fn roll(template: &Template, sample: &Sample) -> f64 {
    let uvs = template.mesh().texture_coordinates().iter();
    let vertices = sample.vertices_camera.iter();
    let along_u: DVec2 = uvs.zip(vertices).map(|(uv, p)| (uv.x - 0.5) * p.truncate()).sum();
    along_u.to_angle()
}

fn look(finder: &mut TargetFinder, template: &Template, sample: &Sample) -> Result<Said> {
    let estimate = pollster::block_on(finder.estimate(&mut View::new(&sample.image, &sample.camera)))?;
    let Some(fit) = estimate.surface.filter(|_| estimate.judgement.found) else {
        return Ok(estimate.judgement.found.then_some((None, None)));
    };
    let canonical = finder.target().canonical_camera(sample.camera.size());
    let truth = tracking_errors::truth_maps(sample, template, &canonical)?;
    let errors = tracking_errors::mesh_errors(template, &fit.vertices_camera, &truth, &canonical)?;
    Ok(Some((errors.registration_rmse_px, errors.points_rmse_mm)))
}

impl Row {
    fn of(roll_deg: Option<f64>, said: impl Iterator<Item = Said> + Clone) -> Self {
        let found = said.clone().flatten();
        Self {
            roll_deg,
            frames: said.count(),
            found: found.clone().count(),
            registration_rmse_px: Spread::of(found.clone().filter_map(|(registration, _)| registration)),
            points_rmse_mm: Spread::of(found.filter_map(|(_, points)| points)),
        }
    }
}

fn print(table: &Camerawise) {
    println!(
        "{} x {} pixels: roll, found, registration px, points mm: median (95th percentile)",
        table.width, table.height
    );
    let told = |errors: Option<Spread>| {
        errors.map_or_else(String::new, |errors| {
            format!("{:.2} ({:.2})", errors.median, errors.p95)
        })
    };
    for row in table.steps.iter().chain([&table.all]) {
        println!(
            "{:>6} {:4} of {:4} {:>16} {:>16}",
            row.roll_deg
                .map_or_else(|| "all".to_owned(), |roll| format!("{roll:.0}")),
            row.found,
            row.frames,
            told(row.registration_rmse_px),
            told(row.points_rmse_mm),
        );
    }
}
