//! `deepsft-lab study calibration`: the focal length found from a sheet that bends, against the true one.

use anyhow::Result;
use clap::Args;
use deepsft::video::{FindingPace, VideoOptions, VideoTracker};
use deepsft::{DeviceKind, Finder, Target, TargetFinder, View};
use deepsft_cli::object_choice::ObjectChoice;
use deepsft_cli::progress;
use deepsft_formats::write_file;
use deepsft_geometry::glam::{DVec2, DVec3};
use deepsft_geometry::metrics::Summary;
use deepsft_geometry::{Camera, CanonicalWarp, SelfCalibration, SelfCalibrationOptions, training_camera};
use deepsft_synth::{ClipEvent, ClipLength, ClipStory, FIRST_CLIP_SEED, SynthConfig, Synthesizer};
use rand::{RngExt, SeedableRng, rngs::StdRng};
use serde::Serialize;
use std::path::PathBuf;
use std::time::Instant;

/// Updates of the camera after which it counts as not found.
const MAX_UPDATES: usize = 20;

#[derive(Args)]
#[command(after_help = "\
Each clip shows a sheet that moves and bends as in two hands, taken with a camera whose focal length is up to --off longer or
shorter than the one that is assumed. The sheet is tracked with the assumed camera; all views together then give the camera.

Example:
  deepsft-lab study calibration --model models/poster-a4 --json calibration.json")]
pub struct CalibrationStudyArguments {
    #[command(flatten)]
    object: ObjectChoice,
    /// Number of clips
    #[arg(long, value_name = "N", default_value_t = 100)]
    clips: u64,
    /// Frames of each clip
    #[arg(long, value_name = "N", default_value_t = 30)]
    frames: usize,
    /// Frames a second
    #[arg(long, value_name = "HZ", default_value_t = 30.0)]
    rate: f64,
    /// Seed of the first clip; the next ones count up
    #[arg(long, value_name = "S", default_value_t = FIRST_CLIP_SEED + 50_000)]
    seed: u64,
    /// Most by which the true focal length is longer or shorter than the assumed one, as a fraction of it
    #[arg(long, value_name = "X", default_value_t = 0.3)]
    off: f64,
    /// Most by which the true principal point is off the assumed one in each direction, as a fraction of f
    #[arg(long, value_name = "X", default_value_t = 0.02)]
    shift: f64,
    /// Most of the true lens's first radial distortion k1, either sign; none is assumed
    #[arg(long, value_name = "X", default_value_t = 0.05)]
    distortion: f64,
    /// Keep views as in an application, the most telling dozen, and not all of them
    #[arg(long)]
    few: bool,
    /// Write the figures to this file
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
}

/// One clip.
#[derive(Serialize)]
struct Row {
    seed: u64,
    /// True focal length as a multiple of the assumed one.
    truth: f64,
    /// Frames in which the sheet was tracked.
    tracked: usize,
    /// Of these: RMS distance of the vertices from the true ones, median, mm.
    before_mm: Option<f64>,
    found: Option<Found>,
    seconds: f64,
}

#[derive(Serialize)]
struct Found {
    /// As a multiple of the assumed one.
    focal: f64,
    /// Stated standard deviation of ln f.
    deviation: f64,
    /// ln of the focal length found over the true one.
    error: f64,
    views: usize,
    /// As `before_mm`, of the views.
    after_mm: Option<f64>,
}

pub fn run(arguments: &CalibrationStudyArguments) -> Result<()> {
    let target = arguments.object.target(DeviceKind::Cpu)?.target;
    let bar = progress::counting(arguments.clips, "clips");
    let mut rows = Vec::new();
    for number in 0..arguments.clips {
        rows.push(measured(arguments, &target, number)?);
        bar.inc(1);
    }
    bar.finish_and_clear();
    print(&rows);
    if let Some(path) = &arguments.json {
        write_file(path, &serde_json::to_vec_pretty(&rows)?)?;
    }
    Ok(())
}

fn measured(arguments: &CalibrationStudyArguments, target: &Target, number: u64) -> Result<Row> {
    let seed = arguments.seed + number;
    let assumed = training_camera();
    let mut random = StdRng::seed_from_u64(seed);
    let mut within = |most: f64| most * (2.0 * random.random::<f64>() - 1.0);
    let truth = (1.0 + arguments.off).powf(within(1.0));
    let focal = assumed.focal() * truth;
    let centre = assumed.principal_point() + focal * DVec2::new(within(arguments.shift), within(arguments.shift));
    let pinhole = Camera::pinhole(assumed.size(), focal, centre)?;
    let lens = CanonicalWarp::new(
        &pinhole,
        &pinhole.with_distortion([within(arguments.distortion), 0.0, 0.0, 0.0, 0.0])?,
    );
    let template = target.template();
    let synthesizer = Synthesizer::new(template, SynthConfig::for_clip_stories(pinhole))?;
    let length = ClipLength {
        frames: arguments.frames,
        frames_per_s: arguments.rate,
        ..ClipLength::default()
    };
    let story = ClipStory::new(&synthesizer, length, ClipEvent::Motion, seed)?;
    let options = match arguments.few {
        true => SelfCalibrationOptions::default(),
        false => SelfCalibrationOptions {
            max_views: arguments.frames,
            min_motion: 0.0,
            ..SelfCalibrationOptions::default()
        },
    };
    let mut calibration = SelfCalibration::new(template, options)?;
    let mut finder = finder(target)?;
    let options = VideoOptions {
        pace: FindingPace::Delayed(0),
        ..VideoOptions::default()
    };
    let mut tracker = VideoTracker::new(&mut finder, options, || 0.0)?;
    let (mut before, mut truths) = (Vec::new(), Vec::new());
    for (frame, sample) in deepsft_synth::clip_frames(&story, 0..arguments.frames).enumerate() {
        let sample = sample?;
        let image = lens.apply(&sample.image)?;
        let mut view = View::new(&image, &assumed);
        let tracked = pollster::block_on(tracker.follow(frame as f64 / arguments.rate, &mut view))?.tracked;
        if tracked.found {
            before.push(distance(&tracked.vertices_camera, &sample.vertices_camera));
            if calibration.offer(view.canonical(&assumed)?, &assumed, &tracked.vertices_camera)? {
                truths.push(sample.vertices_camera);
            }
        }
    }
    let median = |of: Vec<f64>| Summary::of(of.into_iter().map(Some)).map(|summary| summary.median);
    let start = Instant::now();
    let found = calibration.solve(MAX_UPDATES)?;
    let seconds = start.elapsed().as_secs_f64();
    let found = found.map(|found| {
        let focal = found.camera.focal().x / assumed.focal().x;
        let all = calibration.meshes().count() == truths.len();
        let after = calibration
            .meshes()
            .zip(&truths)
            .map(|(mesh, truth)| distance(&mesh, truth));
        Found {
            focal,
            deviation: found.focal_deviation,
            error: (focal / truth).ln(),
            views: found.views,
            after_mm: all.then(|| median(after.collect())).flatten(),
        }
    });
    Ok(Row {
        seed,
        truth,
        tracked: before.len(),
        before_mm: median(before),
        found,
        seconds,
    })
}

/// Looks for the target by its network where it has one: clips have the canonical size, which is little for features.
fn finder(target: &Target) -> Result<TargetFinder> {
    Ok(match target.network() {
        Some(network) => TargetFinder::with_finders(target.clone(), vec![Finder::Network(Box::new(network.clone()))]),
        None => TargetFinder::new(target.clone())?,
    })
}

/// RMS distance, mm.
fn distance(a: &[DVec3], b: &[DVec3]) -> f64 {
    let squares = a.iter().zip(b).map(|(a, b)| a.distance_squared(*b));
    (squares.sum::<f64>() / a.len().max(1) as f64).sqrt()
}

fn print(rows: &[Row]) {
    let found: Vec<&Found> = rows.iter().filter_map(|row| row.found.as_ref()).collect();
    println!("{} of {} clips gave a camera", found.len(), rows.len());
    let quantile = |of: &dyn Fn(&Row) -> Option<f64>, fraction: f64| {
        let mut values: Vec<f64> = rows.iter().filter_map(of).collect();
        values.sort_by(f64::total_cmp);
        let rank = (fraction * values.len() as f64) as usize;
        values.get(rank).copied().unwrap_or(f64::NAN)
    };
    let assumed = |row: &Row| Some(100.0 * (1.0 / row.truth - 1.0).abs());
    let solved = |row: &Row| Some(100.0 * (row.found.as_ref()?.error.exp() - 1.0).abs());
    let after = |row: &Row| row.found.as_ref()?.after_mm;
    let line = |what: &str, unit: &str, of: &dyn Fn(&Row) -> Option<f64>| {
        let [median, most, all] = [0.5, 0.9, 0.999].map(|fraction| quantile(of, fraction));
        println!("{what:32} median {median:6.2} {unit}, 90 % {most:6.2}, most {all:6.2}");
    };
    line("focal length, assumed", "%", &assumed);
    line("focal length, found", "%", &solved);
    line("stated deviation", "%", &|row| {
        Some(100.0 * row.found.as_ref()?.deviation)
    });
    line("mesh before", "mm", &|row| row.before_mm);
    line("mesh after", "mm", &after);
    line("solving", "s", &|row| Some(row.seconds));
    let covered = |deviations: f64| {
        let inside = found
            .iter()
            .filter(|f| f.error.abs() <= deviations * f.deviation)
            .count();
        100.0 * inside as f64 / found.len().max(1) as f64
    };
    println!(
        "within one stated deviation {:.0} % (should be 68), within two {:.0} % (95), within three {:.0} % (99.7)",
        covered(1.0),
        covered(2.0),
        covered(3.0)
    );
    let mean = found.iter().map(|f| f.error).sum::<f64>() / found.len().max(1) as f64;
    println!("mean error of ln f {mean:+.4}");
}
