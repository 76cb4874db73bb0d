//! `deepsft-lab completion accuracy`: what ARAP completion makes of exact maps of which a part is hidden.

use super::picture::panels;
use super::subject::{FrameReport, Object};
use anyhow::{Context, Result};
use clap::Args;
use deepsft::encode_png;
use deepsft_cli::output::sheet;
use deepsft_cli::progress;
use deepsft_formats::write_file;
use deepsft_geometry::metrics::Summary;
use deepsft_geometry::{Camera, training_camera};
use rayon::prelude::*;
use serde::Serialize;
use std::path::PathBuf;

/// Width of a line of the table: hidden fractions from one of these to the next.
const BINS: [f64; 5] = [0.3, 0.4, 0.5, 0.6, 0.7];

/// Frames of each object on the sheet.
const WORST: usize = 6;

#[derive(Args)]
#[command(after_help = "\
Each frame shows an object bent and posed at random. The object itself and one contiguous occluder hide a part of it. The
exact maps of the visible part give the visible vertices; three methods complete the mesh from them:
  ARAP        the whole mesh, completed with the paper's weights, in fewer than 10 iterations
  rigid       the rest shape in the pose of the visible vertices
  Laplacian   displacements from there, interpolated smoothly
The objects are the A4 poster (bends, folds, curled corners, waves) and a closed tube of 240 x 60 mm (smooth bends and
twists) with two charts in its texture. The table has, for each range of hidden fractions:
  hidden      RMSE of the hidden vertices, mm and % of the object's largest extent, median over the frames
  visible     RMSE of the visible vertices before and after, mm
  edges       change of the edges' lengths, median over edges and frames, and 95th percentile
  flipped     faces folded back on a neighbour by more than 90 degrees, of all frames together
  conv        frames whose last step was within a thousandth of an edge; the others took all 9 iterations

Example:
  deepsft-lab completion accuracy --frames 1000 --seed 1 --json completion.json --sheet completion.png")]
pub struct AccuracyArguments {
    /// Frames of each object
    #[arg(long, value_name = "N", default_value_t = 1000, value_parser = clap::value_parser!(u64).range(1..))]
    frames: u64,
    /// Seed of the frames
    #[arg(long, value_name = "S", default_value_t = 1)]
    seed: u64,
    /// Write the figures to this file
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
    /// Draw the worst frames (by hidden vertices) to this PNG file
    #[arg(long, value_name = "FILE")]
    sheet: Option<PathBuf>,
}

/// Medians over the frames of a range of hidden fractions.
#[derive(Serialize)]
struct Row {
    hidden_fraction: [f64; 2],
    frames: usize,
    arap_mm: f64,
    arap_percent: f64,
    /// 95th percentile over the frames.
    arap_p95_mm: f64,
    rigid_mm: f64,
    laplacian_mm: f64,
    /// Fraction of the frames in which ARAP is better than both.
    best_fraction: f64,
    visible_before_mm: f64,
    visible_after_mm: f64,
    edge_change_median: f64,
    edge_change_p95: f64,
    true_edge_change_p95: f64,
    flipped: usize,
    true_flipped: usize,
    /// Fraction of the frames whose last step was within the tolerance; the others ran out of iterations.
    converged_fraction: f64,
}

#[derive(Serialize)]
struct ObjectReport {
    name: &'static str,
    vertices: usize,
    faces: usize,
    extent_mm: f64,
    /// Frames without a visible vertex: nothing to complete.
    without_vertices: u64,
    rows: Vec<Row>,
    all: Row,
    per_frame: Vec<FrameReport>,
}

/// The content of the JSON file.
#[derive(Serialize)]
struct Report {
    seed: u64,
    objects: Vec<ObjectReport>,
    deepsft_version: &'static str,
}

pub fn run(arguments: &AccuracyArguments) -> Result<()> {
    let camera = training_camera();
    let objects = [Object::poster()?, Object::closed()?];
    let mut reports = Vec::new();
    let mut rows_of_panels = Vec::new();
    for object in &objects {
        let bar = progress::counting(arguments.frames, object.name);
        let frames: Result<Vec<Option<FrameReport>>> = (0..arguments.frames)
            .into_par_iter()
            .map_init(
                || object.completion(),
                |completion, index| {
                    let completion = completion.as_mut().map_err(|error| anyhow::anyhow!("{error}"))?;
                    let frame = object.frame(&camera, arguments.seed, index, completion);
                    bar.inc(1);
                    Ok(frame?.map(|frame| frame.report))
                },
            )
            .collect();
        bar.finish_and_clear();
        let frames = frames?;
        let without = frames.iter().filter(|frame| frame.is_none()).count() as u64;
        let frames: Vec<FrameReport> = frames.into_iter().flatten().collect();
        if arguments.sheet.is_some() {
            rows_of_panels.extend(object.worst(&camera, arguments.seed, &frames)?);
        }
        reports.push(object.report(without, frames)?);
    }
    let report = Report {
        seed: arguments.seed,
        objects: reports,
        deepsft_version: env!("CARGO_PKG_VERSION"),
    };
    print(&report);
    if let Some(path) = &arguments.json {
        write_file(path, &serde_json::to_vec_pretty(&report)?)?;
    }
    if let Some(path) = &arguments.sheet {
        let sheet = sheet::sheet(&rows_of_panels).context("there is no frame to draw")?;
        write_file(path, &encode_png(&sheet)?)?;
    }
    Ok(())
}

impl Object {
    fn report(&self, without_vertices: u64, per_frame: Vec<FrameReport>) -> Result<ObjectReport> {
        let rows = BINS.windows(2).filter_map(|bin| {
            let hidden_fraction = [bin[0], bin[1]];
            let frames: Vec<FrameReport> = (per_frame.iter().copied())
                .filter(|frame| (hidden_fraction[0]..hidden_fraction[1]).contains(&frame.hidden_fraction))
                .collect();
            self.row(hidden_fraction, &frames)
        });
        Ok(ObjectReport {
            name: self.name,
            vertices: self.welding.mesh().vertices().len(),
            faces: self.mesh.faces().len(),
            extent_mm: self.extent,
            without_vertices,
            rows: rows.collect(),
            all: self.row([0.0, 1.0], &per_frame).context("no frame shows a vertex")?,
            per_frame,
        })
    }

    /// `None` without frames.
    fn row(&self, hidden_fraction: [f64; 2], frames: &[FrameReport]) -> Option<Row> {
        let median = |of: fn(&FrameReport) -> f64| Summary::of(frames.iter().map(|f| Some(of(f)))).map(|s| s.median);
        let mut errors: Vec<f64> = frames.iter().map(|f| f.arap_mm).collect();
        errors.sort_by(f64::total_cmp);
        let best = frames
            .iter()
            .filter(|f| f.arap_mm < f.rigid_mm.min(f.laplacian_mm))
            .count();
        let arap_mm = median(|f| f.arap_mm)?;
        Some(Row {
            hidden_fraction,
            frames: frames.len(),
            arap_mm,
            arap_percent: 100.0 * arap_mm / self.extent,
            arap_p95_mm: errors[(errors.len() - 1) * 19 / 20],
            rigid_mm: median(|f| f.rigid_mm)?,
            laplacian_mm: median(|f| f.laplacian_mm)?,
            best_fraction: best as f64 / frames.len() as f64,
            visible_before_mm: median(|f| f.visible_before_mm)?,
            visible_after_mm: median(|f| f.visible_after_mm)?,
            edge_change_median: median(|f| f.edge_change_median)?,
            edge_change_p95: median(|f| f.edge_change_p95)?,
            true_edge_change_p95: median(|f| f.true_edge_change_p95)?,
            flipped: frames.iter().map(|f| f.flipped).sum(),
            true_flipped: frames.iter().map(|f| f.true_flipped).sum(),
            converged_fraction: frames.iter().filter(|f| f.converged).count() as f64 / frames.len() as f64,
        })
    }

    /// The frames with the largest error of hidden vertices, worst first.
    fn worst(&self, camera: &Camera, seed: u64, frames: &[FrameReport]) -> Result<Vec<sheet::Row>> {
        let mut order: Vec<&FrameReport> = frames.iter().collect();
        order.sort_by(|a, b| b.arap_mm.total_cmp(&a.arap_mm));
        let mut completion = self.completion()?;
        let mut rows = Vec::new();
        for frame in order.into_iter().take(WORST) {
            if let Some(completed) = self.frame(camera, seed, frame.index, &mut completion)? {
                rows.push(panels(self, camera, &completed));
            }
        }
        Ok(rows)
    }
}

fn print(report: &Report) {
    for object in &report.objects {
        println!(
            "{}: {} vertices, {} faces, {:.0} mm; {} frames{}",
            object.name,
            object.vertices,
            object.faces,
            object.extent_mm,
            object.all.frames,
            if object.without_vertices > 0 {
                format!(", {} more without a visible vertex", object.without_vertices)
            } else {
                String::new()
            }
        );
        println!(
            "  {:<10}{:>7}{:>9}{:>7}{:>8}{:>8}{:>11}{:>7}{:>9}{:>8}{:>9}{:>8}{:>9}{:>8}",
            "hidden",
            "frames",
            "ARAP mm",
            "%",
            "p95 mm",
            "rigid",
            "Laplacian",
            "best",
            "visible",
            "after",
            "edges %",
            "p95 %",
            "flipped",
            "conv %"
        );
        for row in object.rows.iter().chain([&object.all]) {
            let [low, high] = row.hidden_fraction.map(|fraction| 100.0 * fraction);
            println!(
                "  {:<10}{:>7}{:>9.2}{:>7.2}{:>8.1}{:>8.1}{:>11.1}{:>5.0} %{:>9.2}{:>8.2}{:>9.2}{:>8.2}{:>9}{:>8.0}",
                if high > 99.0 {
                    "all".to_owned()
                } else {
                    format!("{low:.0}-{high:.0} %")
                },
                row.frames,
                row.arap_mm,
                row.arap_percent,
                row.arap_p95_mm,
                row.rigid_mm,
                row.laplacian_mm,
                100.0 * row.best_fraction,
                row.visible_before_mm,
                row.visible_after_mm,
                100.0 * row.edge_change_median,
                100.0 * row.edge_change_p95,
                row.flipped,
                100.0 * row.converged_fraction
            );
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn completion_beats_the_simple_methods_on_most_frames_of_both_objects() {
        let camera = training_camera();
        for object in [Object::poster().unwrap(), Object::closed().unwrap()] {
            let mut completion = object.completion().unwrap();
            let frames: Vec<FrameReport> = (0..30)
                .filter_map(|index| object.frame(&camera, 77, index, &mut completion).unwrap())
                .map(|completed| completed.report)
                .collect();
            let report = object.report(0, frames).unwrap();
            let all = &report.all;
            assert_eq!(all.frames, 30);
            assert!(
                all.arap_mm < all.rigid_mm && all.arap_mm < all.laplacian_mm,
                "{}",
                object.name
            );
            assert!(all.best_fraction > 0.6, "{}: {}", object.name, all.best_fraction);
            // Nine iterations need not suffice, enough of them must.
            completion.set_max_iterations(5000);
            let settled = object.frame(&camera, 77, 0, &mut completion).unwrap().unwrap();
            assert!(settled.report.converged, "{}", object.name);
        }
    }
}
