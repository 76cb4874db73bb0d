//! `deepsft-lab completion speed`: ARAP completion on meshes of 1,500 to 40,000 faces, beside another program.
//!
//! Both programs get the same rest mesh, the same half of the vertices at their true places, and the same start.
//! The other program holds the given vertices exactly; ours gets such large weights that it comes to the same.
//! The other program also computes the energy of both results, so that there is one measure.

use super::benchmark_shape::{BenchmarkFrame, BenchmarkShape};
use crate::measuring::{self, Process, Rival, Times};
use anyhow::{Context, Result};
use clap::Args;
use deepsft_formats::write_file;
use deepsft_geometry::glam::DVec3;
use deepsft_geometry::{ArapCompletion, CompletionOptions};
use serde::{Deserialize, Serialize};
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Instant;

/// Weight of the given vertices beside 1 for ARAP: the heavy-data limit.
const HEAVY: f64 = 1e6;

/// Iterations of both programs.
const ITERATIONS: usize = 10;

/// Fraction by which our energy may be above the other program's and still count as reaching it: both end at
/// the same minimum where frames are easy, and there rounding decides.
const SAME_ENERGY: f64 = 1e-6;

/// Iterations after which both programs stand still, on meshes that are small enough for local steps to get there.
const ITERATIONS_TO_CONVERGE: usize = 5_000;
const MAX_VERTICES_TO_CONVERGE: usize = 1_000;

#[derive(Args)]
#[command(after_help = "\
The command measures on one thread, for sheets and closed meshes of about 1,500, 6,000, 11,000 and 40,000 faces:
  precompute   everything that is done once for a template
  new set      a frame that shows another half of the vertices: factorisation and 10 iterations
  warm         the same from the last frame's mesh, as many iterations as it takes to reach the energy that the
               other program reaches in 10 from the same start
  MB           memory of the factorised matrix
Times are medians over --runs frames. Run nothing else meanwhile. `cargo xtask bench --only completion`
installs libigl and lets it take turns frame by frame.

Example:
  deepsft-lab completion speed --json completion-speed.json")]
pub struct SpeedArguments {
    /// Write the figures to this file
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
    /// Frames for each median
    #[arg(long, value_name = "N", default_value_t = 15, value_parser = clap::value_parser!(u32).range(1..))]
    runs: u32,
    /// Name of another program that does the same, started by the words after `--`
    #[arg(long, value_name = "NAME", hide = true, requires = "rival_command")]
    rival: Option<String>,
    /// Program and arguments of the rival
    #[arg(last = true, value_name = "COMMAND", hide = true, requires = "rival")]
    rival_command: Vec<String>,
}

/// The content of the JSON file.
#[derive(Serialize)]
struct Report {
    processor: Option<String>,
    runs: u32,
    rival: Option<String>,
    shapes: Vec<ShapeReport>,
    deepsft_version: &'static str,
}

#[derive(Serialize)]
struct ShapeReport {
    name: &'static str,
    faces: usize,
    vertices: usize,
    factor_megabytes: f64,
    precompute: Times,
    new_set: Times,
    rival: Option<RivalReport>,
}

#[derive(Serialize)]
struct RivalReport {
    precompute: Times,
    /// Precompute and iterations: the set of given vertices is part of its precompute.
    new_set: Times,
    /// Our energy over the rival's: greatest over the frames, and median.
    energy_ratio: Spread,
    /// The same when both run until nothing changes; only of the smallest shapes.
    converged_energy_ratio: Option<f64>,
    /// Ours from the last frame's mesh.
    warm: Times,
    warm_iterations: Spread,
    /// The rival's precompute and iterations from the same mesh.
    rival_warm: Times,
    /// Our median over the rival's.
    precompute_ratio: f64,
    new_set_ratio: f64,
    warm_ratio: f64,
}

#[derive(Clone, Copy, Serialize)]
struct Spread {
    median: f64,
    most: f64,
}

/// What the rival answers.
#[derive(Deserialize)]
struct Answer {
    precompute_ms: f64,
    solve_ms: f64,
    energy: f64,
}

pub fn run(arguments: &SpeedArguments) -> Result<()> {
    let folder = tempfile::tempdir()?;
    let mut rival = None;
    if let Some(name) = &arguments.rival {
        let other = Rival {
            name,
            command: &arguments.rival_command,
        };
        rival = Some(Opponent::start(other, folder.path())?);
    }
    let mut shapes = Vec::new();
    for shape in BenchmarkShape::all()? {
        eprintln!("{} of {} faces", shape.name, shape.mesh.faces().len());
        shapes.push(measure(&shape, arguments.runs as usize, rival.as_mut())?);
    }
    let report = Report {
        processor: measuring::processor(),
        runs: arguments.runs,
        rival: arguments.rival.clone(),
        shapes,
        deepsft_version: env!("CARGO_PKG_VERSION"),
    };
    print(&report);
    if let Some(path) = &arguments.json {
        write_file(path, &serde_json::to_vec_pretty(&report)?)?;
    }
    Ok(())
}

/// Our completion with a number of iterations, all of which are done.
fn options(max_iterations: usize) -> CompletionOptions {
    CompletionOptions {
        arap_weight: 1.0,
        smoothness_weight: 0.0,
        max_iterations,
        step_tolerance: 0.0,
    }
}

fn measure(shape: &BenchmarkShape, runs: usize, mut rival: Option<&mut Opponent>) -> Result<ShapeReport> {
    let mut ours = Turns::default();
    let mut theirs = Turns::default();
    let (mut warm, mut rival_warm) = (Vec::new(), Vec::new());
    let (mut energies, mut warm_iterations) = (Vec::new(), Vec::new());
    let mut completion = ArapCompletion::new(&shape.mesh, options(ITERATIONS))?;
    if let Some(rival) = rival.as_deref_mut() {
        rival.take_mesh(shape)?;
    }
    // The first frame only warms up.
    let mut last = completion.complete(&shape.frame(0).points(HEAVY), None)?.vertices;
    for index in 1..=runs {
        let frame = shape.frame(index);
        let points = frame.points(HEAVY);
        let started = Instant::now();
        completion = ArapCompletion::new(&shape.mesh, options(ITERATIONS))?;
        ours.precompute.push(milliseconds(started));
        // A completion that has seen a frame, as in a video: its memory is claimed.
        completion.complete(&shape.frame(index - 1).points(HEAVY), None)?;
        let started = Instant::now();
        let completed = completion.complete(&points, None)?;
        ours.new_set.push(milliseconds(started));
        if let Some(rival) = rival.as_deref_mut() {
            let cold = rival.solve(&frame, &frame.aligned(shape.mesh.vertices()), ITERATIONS)?;
            theirs.precompute.push(cold.precompute_ms);
            theirs.new_set.push(cold.precompute_ms + cold.solve_ms);
            energies.push(rival.energy_of(&completed.vertices)? / cold.energy);
            let answer = rival.solve(&frame, &last, ITERATIONS)?;
            rival_warm.push(answer.precompute_ms + answer.solve_ms);
            let mut iterations = 0;
            loop {
                iterations += 1;
                completion.set_max_iterations(iterations);
                let started = Instant::now();
                let completed = completion.complete(&points, Some(&last))?;
                let elapsed = milliseconds(started);
                let reached = rival.energy_of(&completed.vertices)? <= answer.energy * (1.0 + SAME_ENERGY);
                if reached || iterations == 10 * ITERATIONS {
                    warm.push(elapsed);
                    warm_iterations.push(iterations as f64);
                    break;
                }
            }
        }
        last = completed.vertices;
    }
    let converged_energy_ratio = match rival.as_deref_mut() {
        Some(rival) if shape.mesh.vertices().len() <= MAX_VERTICES_TO_CONVERGE => {
            Some(converged_ratio(shape, runs, rival)?)
        }
        _ => None,
    };
    let (precompute, new_set) = (times(ours.precompute)?, times(ours.new_set)?);
    let rival = match rival {
        Some(_) => {
            let (rival_precompute, rival_new_set) = (times(theirs.precompute)?, times(theirs.new_set)?);
            let (warm, rival_warm) = (times(warm)?, times(rival_warm)?);
            Some(RivalReport {
                precompute_ratio: precompute.median_ms / rival_precompute.median_ms,
                new_set_ratio: new_set.median_ms / rival_new_set.median_ms,
                warm_ratio: warm.median_ms / rival_warm.median_ms,
                precompute: rival_precompute,
                new_set: rival_new_set,
                energy_ratio: Spread::of(energies)?,
                converged_energy_ratio,
                warm,
                warm_iterations: Spread::of(warm_iterations)?,
                rival_warm,
            })
        }
        None => None,
    };
    Ok(ShapeReport {
        name: shape.name,
        faces: shape.mesh.faces().len(),
        vertices: shape.mesh.vertices().len(),
        factor_megabytes: completion.factor_entries() as f64 * size_of::<f64>() as f64 / 1e6,
        precompute,
        new_set,
        rival,
    })
}

/// Our energy over the rival's when both have gone on until nothing changes.
fn converged_ratio(shape: &BenchmarkShape, index: usize, rival: &mut Opponent) -> Result<f64> {
    let iterations = ITERATIONS_TO_CONVERGE;
    let frame = shape.frame(index);
    let mut completion = ArapCompletion::new(&shape.mesh, options(iterations))?;
    let completed = completion.complete(&frame.points(HEAVY), None)?;
    let answer = rival.solve(&frame, &frame.aligned(shape.mesh.vertices()), iterations)?;
    Ok(rival.energy_of(&completed.vertices)? / answer.energy)
}

#[derive(Default)]
struct Turns {
    precompute: Vec<f64>,
    new_set: Vec<f64>,
}

fn milliseconds(since: Instant) -> f64 {
    since.elapsed().as_secs_f64() * 1e3
}

fn times(times: Vec<f64>) -> Result<Times> {
    Times::of(times).context("nothing was measured")
}

impl Spread {
    fn of(mut values: Vec<f64>) -> Result<Self> {
        values.sort_by(f64::total_cmp);
        let most = *values.last().context("nothing was measured")?;
        Ok(Self {
            median: values[values.len() / 2],
            most,
        })
    }
}

/// The other program. It reads plain little-endian arrays from a folder: `vertices.f64` and `faces.i64` of the rest
/// mesh, `given.i32`, `places.f64` and `start.f64` of a frame, `result.f64` of ours.
struct Opponent {
    process: Process,
    folder: PathBuf,
}

impl Opponent {
    fn start(rival: Rival<'_>, folder: &Path) -> Result<Self> {
        let (program, arguments) = rival.command.split_first().context("the rival has no program")?;
        let process = Process::start(Command::new(program).args(arguments).arg(folder), 1)?;
        Ok(Self {
            process,
            folder: folder.to_owned(),
        })
    }

    fn write(&self, name: &str, bytes: Vec<u8>) -> Result<()> {
        let path = self.folder.join(name);
        fs::write(&path, bytes).with_context(|| format!("writing {}", path.display()))
    }

    fn take_mesh(&mut self, shape: &BenchmarkShape) -> Result<()> {
        self.write("vertices.f64", points_as_bytes(shape.mesh.vertices().iter().copied()))?;
        let indices = shape.mesh.faces().iter().flatten();
        self.write("faces.i64", indices.flat_map(|&v| (v as i64).to_le_bytes()).collect())?;
        self.process.ask("mesh").map(|_| ())
    }

    fn solve(&mut self, frame: &BenchmarkFrame, start: &[DVec3], iterations: usize) -> Result<Answer> {
        let indices = frame.given.iter();
        self.write("given.i32", indices.flat_map(|&v| (v as i32).to_le_bytes()).collect())?;
        self.write(
            "places.f64",
            points_as_bytes(frame.given.iter().map(|&v| frame.truth[v])),
        )?;
        self.write("start.f64", points_as_bytes(start.iter().copied()))?;
        let answer = self.process.ask(&format!("solve {iterations}"))?;
        serde_json::from_str(&answer).with_context(|| format!("the rival answered {answer:?}"))
    }

    fn energy_of(&mut self, vertices: &[DVec3]) -> Result<f64> {
        self.write("result.f64", points_as_bytes(vertices.iter().copied()))?;
        let answer = self.process.ask("energy")?;
        answer.parse().with_context(|| format!("the rival answered {answer:?}"))
    }
}

fn points_as_bytes(points: impl Iterator<Item = DVec3>) -> Vec<u8> {
    points.flat_map(|p| p.to_array()).flat_map(f64::to_le_bytes).collect()
}

fn print(report: &Report) {
    println!(
        "{}, one thread, medians of {} frames, ms; half of the vertices given",
        report.processor.as_deref().unwrap_or("unknown processor"),
        report.runs
    );
    print!(
        "{:<8}{:>8}{:>9}{:>7}{:>12}{:>10}",
        "shape", "faces", "vertices", "MB", "precompute", "new set"
    );
    if let Some(name) = &report.rival {
        print!(
            "{:>12}   {name}: precompute, new set, warm; ratios; energy, converged; warm iterations",
            "warm"
        );
    }
    println!();
    for shape in &report.shapes {
        print!(
            "{:<8}{:>8}{:>9}{:>7.1}{:>12.2}{:>10.2}",
            shape.name,
            shape.faces,
            shape.vertices,
            shape.factor_megabytes,
            shape.precompute.median_ms,
            shape.new_set.median_ms
        );
        if let Some(rival) = &shape.rival {
            print!(
                "{:>12.2}   {:>8.2}{:>9.2}{:>9.2}   {:>5.2}{:>6.2}{:>6.2}   {:.6}, {:.6}   {:.0} (most {:.0})",
                rival.warm.median_ms,
                rival.precompute.median_ms,
                rival.new_set.median_ms,
                rival.rival_warm.median_ms,
                rival.precompute_ratio,
                rival.new_set_ratio,
                rival.warm_ratio,
                rival.energy_ratio.most,
                rival.converged_energy_ratio.unwrap_or(f64::NAN),
                rival.warm_iterations.median,
                rival.warm_iterations.most,
            );
        }
        println!();
    }
}
