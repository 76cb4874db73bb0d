//! `deepsft-lab study solids`: how often objects with a volume are found without training, and how exact the fit is.

use super::frames::{cell, frames_config, within_deviations};
use crate::measuring::{Spread, median};
use anyhow::{Result, ensure};
use clap::Args;
use deepsft::{Target, TargetFinder, View};
use deepsft_formats::read_template;
use deepsft_geometry::metrics::{Summary, frame_metrics, registration_error_px};
use deepsft_geometry::raster::VisibleSurface;
use deepsft_synth::{Sample, Synthesizer};
use indicatif::ProgressBar;
use std::path::PathBuf;
use std::time::Instant;

/// A frame is right with a median registration error below this, pixels of the canonical image.
const RIGHT_PX: f64 = 2.0;

#[derive(Args)]
#[command(after_help = "\
Frames of 960 x 540 pixels by our renderer: the object bent, any way up, from all sides. Each object is looked for in its own frames, and in
those of the next one. Right: found, and the median registration error is below 2 px of the canonical image (480 x 270). Errors are those of
right frames, median (95th percentile): that median; RMSE of the points that the camera would see; median distance of all vertices. At the
end how many vertices lie within one and two of their stated standard deviations, the mean over right frames.")]
pub struct SolidsArguments {
    /// Folders of templates
    #[arg(value_name = "TEMPLATE", required = true)]
    templates: Vec<PathBuf>,
    /// Frames of each
    #[arg(long, default_value_t = 20)]
    frames: u64,
    /// Seed of the frames
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Objects that are not bent: boxes and tins
    #[arg(long)]
    at_rest: bool,
}

struct Object {
    name: String,
    finder: TargetFinder,
    synthesizer: Synthesizer,
}

pub fn run(arguments: &SolidsArguments) -> Result<()> {
    let mut config = frames_config()?;
    if arguments.at_rest {
        config = config.at_rest();
    }
    let mut objects = Vec::new();
    for folder in &arguments.templates {
        let template = read_template(folder)?;
        objects.push(Object {
            name: folder.display().to_string(),
            synthesizer: Synthesizer::new(&template, config.clone())?,
            finder: TargetFinder::new(Target::from_template(template))?,
        });
    }
    ensure!(arguments.frames > 0, "no frames are to be made");
    println!(
        "| object | frames | found | right | false finds | registration, px | points, mm | vertices, mm | time, ms | \
         within 1 and 2 deviations, % |"
    );
    println!("|---|---|---|---|---|---|---|---|---|---|");
    for k in 0..objects.len() {
        let progress = ProgressBar::new(arguments.frames);
        let (mut shown, mut found, mut false_finds) = (0, 0, 0);
        let [mut registration, mut points, mut vertices, mut times] = [(); 4].map(|()| Vec::new());
        let mut within = Vec::new();
        for index in 0..arguments.frames {
            let sample = objects[k].synthesizer.sample(arguments.seed, index);
            progress.inc(1);
            if !sample.has_template {
                continue;
            }
            shown += 1;
            let began = Instant::now();
            let errors = errors(&mut objects[k].finder, &sample)?;
            times.push(began.elapsed().as_secs_f64() * 1e3);
            let next = (k + 1) % objects.len();
            let mut view = View::new(&sample.image, &sample.camera);
            if next != k
                && pollster::block_on(objects[next].finder.estimate(&mut view))?
                    .judgement
                    .found
            {
                false_finds += 1;
            }
            let Some(([px, point_mm, vertex_mm], inside)) = errors else {
                continue;
            };
            found += 1;
            if px < RIGHT_PX {
                registration.push(px);
                points.push(point_mm);
                vertices.push(vertex_mm);
                within.push(inside);
            }
        }
        let right = registration.len();
        print!("| {} | {shown} | {found} | {right} | {false_finds} |", objects[k].name);
        for errors in [registration, points, vertices, times] {
            print!(" {} |", cell(Spread::of(errors)));
        }
        let percent = |k: usize| 100.0 * within.iter().map(|of| of[k]).sum::<f64>() / right.max(1) as f64;
        println!(" {:.0}, {:.0} |", percent(0), percent(1));
    }
    Ok(())
}

/// Of a found object: the median registration error (pixels), the RMSE of the points that the camera would see if nothing hid them, and the
/// median distance of all vertices (mm). Also the fractions of the vertices within their stated deviations.
fn errors(finder: &mut TargetFinder, sample: &Sample) -> Result<Option<([f64; 3], [f64; 2])>> {
    let estimate = pollster::block_on(finder.estimate(&mut View::new(&sample.image, &sample.camera)))?;
    let Some(surface) = estimate.surface.filter(|_| estimate.judgement.found) else {
        return Ok(None);
    };
    let (template, camera) = (finder.target().template(), &estimate.canonical_camera);
    let drawn = |vertices| VisibleSurface::new(template.mesh(), vertices, camera).maps();
    let (maps, truth) = (drawn(&surface.vertices_camera), drawn(&sample.vertices_camera));
    let error = |pixel| Some(registration_error_px(&maps, &truth, camera, pixel, template)?.length());
    let registration = median((0..camera.size().area()).filter_map(error));
    let points = frame_metrics(&maps, &truth, camera, template)?.points_rmse_mm;
    let pairs = surface.vertices_camera.iter().zip(&sample.vertices_camera);
    let vertices = Summary::of(pairs.map(|(a, b)| Some(a.distance(*b))));
    let (registration, points) = (registration.unwrap_or(f64::INFINITY), points.unwrap_or(f64::INFINITY));
    let within = within_deviations(&surface, &sample.vertices_camera);
    Ok(vertices.map(|vertices| ([registration, points, vertices.median], within)))
}
