//! `deepsft-lab study solids`: how often objects with a volume are found without training, and how exact the fit is.

use crate::measuring::{Spread, median};
use crate::progress::Progress;
use anyhow::{Result, ensure};
use clap::Args;
use deepsft::{Target, TargetFinder, View};
use deepsft_formats::read_template;
use deepsft_geometry::Camera;
use deepsft_geometry::glam::DVec2;
use deepsft_geometry::metrics::{Summary, frame_metrics, registration_error_px};
use deepsft_geometry::raster::VisibleSurface;
use deepsft_synth::{Sample, SynthConfig, Synthesizer};
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

/// One object.
struct Object {
    name: String,
    finder: TargetFinder,
    synthesizer: Synthesizer,
}

pub fn run(arguments: &SolidsArguments) -> Result<()> {
    let focal = DVec2::splat(760.0);
    let mut config = SynthConfig {
        camera: Camera::pinhole((960, 540), focal, DVec2::new(480.0, 270.0))?,
        empty_probability: 0.0,
        ..SynthConfig::default()
    };
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
        let mut progress = Progress::of(arguments.frames, "frames");
        let (mut shown, mut found, mut false_finds) = (0, 0, 0);
        let [mut registration, mut points, mut vertices, mut times] = [(); 4].map(|()| Vec::new());
        let mut within = [Vec::new(), Vec::new()];
        for index in 0..arguments.frames {
            let sample = objects[k].synthesizer.sample(arguments.seed, index);
            progress.step();
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
            let Some(([px, point_mm, vertex_mm], multiples)) = errors else {
                continue;
            };
            found += 1;
            if px < RIGHT_PX {
                registration.push(px);
                points.push(point_mm);
                vertices.push(vertex_mm);
                for (within, most) in within.iter_mut().zip([1.0, 2.0]) {
                    let inside = multiples.iter().filter(|multiple| **multiple < most).count();
                    within.push(100.0 * inside as f64 / multiples.len() as f64);
                }
            }
        }
        let right = registration.len();
        print!("| {} | {shown} | {found} | {right} | {false_finds} |", objects[k].name);
        for errors in [registration, points, vertices, times] {
            match Spread::of(errors) {
                Some(Spread { median, p95, .. }) => print!(" **{median:.2}** ({p95:.2}) |"),
                None => print!(" - |"),
            }
        }
        let mean = |of: &Vec<f64>| of.iter().sum::<f64>() / of.len().max(1) as f64;
        println!(" {:.0}, {:.0} |", mean(&within[0]), mean(&within[1]));
    }
    Ok(())
}

/// Of a found object: the median registration error (pixels), the RMSE of the points that the camera would see if nothing hid them, and the
/// median distance of all vertices (mm). Also that of each vertex as a multiple of its stated standard deviation.
fn errors(finder: &mut TargetFinder, sample: &Sample) -> Result<Option<([f64; 3], Vec<f64>)>> {
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
    let stated = surface.deviations.iter().map(|deviation| f64::from(*deviation));
    let ways = surface
        .vertices_camera
        .iter()
        .zip(&sample.vertices_camera)
        .map(|(a, b)| a.distance(*b));
    let multiples = ways.zip(stated).map(|(way, deviation)| way / deviation).collect();
    Ok(vertices.map(|vertices| ([registration, points, vertices.median], multiples)))
}
