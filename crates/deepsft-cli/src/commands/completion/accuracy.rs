//! `deepsft completion accuracy`: what ARAP completion makes of exact maps of which a part is hidden.

use super::interpolation::{laplacian, rigid};
use super::picture::{shaded, turned};
use crate::output::color_map::ColorMap;
use crate::output::{atomic, sheet};
use crate::progress;
use anyhow::{Context, Result};
use clap::Args;
use deepsft::encode_png;
use deepsft_geometry::glam::DVec3;
use deepsft_geometry::metrics::Summary;
use deepsft_geometry::solver::VertexPoint;
use deepsft_geometry::{
    ArapCompletion, Camera, CompletionOptions, Picture, Template, TriangleMesh, VisibleVertices, Welding,
    training_camera,
};
use deepsft_synth::{
    POSTER_HEIGHT_MM, POSTER_WIDTH_MM, PartialView, SynthConfig, Synthesizer, capsule, edge_length_change,
};
use rayon::prelude::*;
use serde::Serialize;
use std::path::PathBuf;

/// Hidden shares that are drawn, of a sheet's vertices and of a closed mesh's, whose back is always hidden.
const SHEET_HIDDEN: [f64; 2] = [0.3, 0.7];
const CLOSED_HIDDEN: [f64; 2] = [0.5, 0.7];

/// The closed mesh: length and radius in mm, vertices from pole to pole and around.
const CLOSED_MM: [f64; 2] = [240.0, 30.0];
const CLOSED_VERTICES: [usize; 2] = [41, 24];

/// Width of a line of the table: hidden shares from one of these to the next.
const BINS: [f64; 5] = [0.3, 0.4, 0.5, 0.6, 0.7];

/// Frames of each object on the sheet.
const WORST: usize = 6;

/// End of the error scale on the sheet, mm.
const ERROR_SCALE_MM: f64 = 30.0;

/// How far the side view is turned, radians.
const SIDE_RAD: f64 = 1.0;

#[derive(Args)]
#[command(after_help = "\
Each frame is an object bent and posed at random, of which the camera sees a part: the rest is hidden by the object
itself and by one contiguous occluder. From the exact maps of the visible part come the visible vertices, from them
  ARAP        the whole mesh, completed with the paper's weights, in fewer than 10 iterations
  rigid       the rest shape in the pose of the visible vertices
  Laplacian   displacements from there, interpolated smoothly
Objects are the A4 poster (bends, folds, curled corners, waves) and a closed tube of 240 x 60 mm (smooth bends and
twists) with two charts in its texture. The table has, for each range of hidden shares:
  hidden      RMSE of the hidden vertices, mm and % of the object's largest extent, median over the frames
  visible     RMSE of the visible vertices before and after, mm
  edges       change of the edges' lengths, median over edges and frames, and 95th percentile
  flipped     faces folded back on a neighbour by more than 90 degrees, of all frames together

Example:
  deepsft completion accuracy --frames 1000 --seed 1 --json completion.json --sheet completion.png")]
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

/// An object whose hidden parts are completed.
struct Object {
    name: &'static str,
    mesh: TriangleMesh,
    welding: Welding,
    /// Largest extent of the rest shape, mm.
    extent: f64,
    hidden: [f64; 2],
    /// The sheet's bends; none for the closed mesh.
    synthesizer: Option<Synthesizer>,
}

/// The errors of one method on one frame.
#[derive(Clone, Copy, Serialize)]
struct FrameReport {
    index: u64,
    hidden_share: f64,
    /// RMSE of the hidden vertices, mm.
    arap_mm: f64,
    rigid_mm: f64,
    laplacian_mm: f64,
    /// RMSE of the visible vertices, mm.
    visible_before_mm: f64,
    visible_after_mm: f64,
    /// Relative change of edge lengths of the result, and of the truth.
    edge_change_median: f64,
    edge_change_p95: f64,
    true_edge_change_p95: f64,
    flipped: usize,
    true_flipped: usize,
    iterations: usize,
}

/// Medians over the frames of a range of hidden shares.
#[derive(Serialize)]
struct Row {
    hidden_share: [f64; 2],
    frames: usize,
    arap_mm: f64,
    arap_percent: f64,
    /// 95th percentile over the frames.
    arap_p95_mm: f64,
    rigid_mm: f64,
    laplacian_mm: f64,
    /// Share of the frames in which ARAP is better than both.
    best_share: f64,
    visible_before_mm: f64,
    visible_after_mm: f64,
    edge_change_median: f64,
    edge_change_p95: f64,
    true_edge_change_p95: f64,
    flipped: usize,
    true_flipped: usize,
    most_iterations: usize,
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
        atomic::write_file(path, &serde_json::to_vec_pretty(&report)?)?;
    }
    if let Some(path) = &arguments.sheet {
        let sheet = sheet::sheet(&rows_of_panels).context("there is no frame to draw")?;
        atomic::write_file(path, &encode_png(&sheet)?)?;
    }
    Ok(())
}

/// A frame with its result.
struct Completed {
    report: FrameReport,
    view: PartialView,
    points: Vec<VertexPoint>,
    vertices: Vec<DVec3>,
}

impl Object {
    fn poster() -> Result<Self> {
        let picture = Picture::from_fn(1, 1, |_, _| [255; 3]);
        let template = Template::thin_shell(picture, POSTER_WIDTH_MM, POSTER_HEIGHT_MM)?;
        let synthesizer = Synthesizer::new(&template, SynthConfig::default())?;
        Self::new("poster", template.mesh().clone(), SHEET_HIDDEN, Some(synthesizer))
    }

    fn closed() -> Result<Self> {
        let ([length, radius], [rings, around]) = (CLOSED_MM, CLOSED_VERTICES);
        Self::new("closed", capsule(length, radius, rings, around)?, CLOSED_HIDDEN, None)
    }

    fn new(name: &'static str, mesh: TriangleMesh, hidden: [f64; 2], synthesizer: Option<Synthesizer>) -> Result<Self> {
        let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        for p in mesh.vertices() {
            (low, high) = (low.min(*p), high.max(*p));
        }
        Ok(Self {
            name,
            welding: Welding::of(&mesh)?,
            extent: (high - low).max_element(),
            mesh,
            hidden,
            synthesizer,
        })
    }

    fn completion(&self) -> Result<ArapCompletion> {
        Ok(ArapCompletion::new(&self.mesh, CompletionOptions::default())?)
    }

    /// Frame `index`; `None` when it shows no vertex.
    fn frame(
        &self,
        camera: &Camera,
        seed: u64,
        index: u64,
        completion: &mut ArapCompletion,
    ) -> Result<Option<Completed>> {
        let view = match &self.synthesizer {
            Some(synthesizer) => PartialView::of_sheet(synthesizer, self.hidden, seed, index),
            None => PartialView::of_volumic(&self.mesh, camera, self.hidden, seed, index),
        };
        let points = VisibleVertices::new(&self.mesh, 0).find(&view.maps, camera)?;
        if points.is_empty() {
            return Ok(None);
        }
        let completed = completion.complete(&points, None)?;
        let (rest, truth) = (self.mesh.vertices(), &view.vertices_camera);
        // A vertex on a seam is visible when one of its copies is.
        let mut seen = vec![false; self.welding.mesh().vertices().len()];
        points
            .iter()
            .filter_map(|p| self.welding.welded(p.vertex))
            .for_each(|vertex| seen[vertex] = true);
        let welded_truth = self.welding.weld(truth);
        let error_of = |vertices: &[DVec3], of_seen: bool| {
            let vertices = self.welding.weld(vertices);
            rmse(
                (0..seen.len())
                    .filter(|&i| seen[i] == of_seen)
                    .map(|i| vertices[i].distance(welded_truth[i])),
            )
        };
        let (change, true_change) = (
            edge_length_change(&self.mesh, &completed.vertices),
            edge_length_change(&self.mesh, truth),
        );
        let report = FrameReport {
            index,
            hidden_share: seen.iter().filter(|seen| !**seen).count() as f64 / seen.len() as f64,
            arap_mm: error_of(&completed.vertices, false),
            rigid_mm: error_of(&rigid(rest, &points), false),
            laplacian_mm: error_of(&laplacian(&self.welding, rest, &points), false),
            visible_before_mm: rmse(points.iter().map(|p| p.p_camera.distance(truth[p.vertex]))),
            visible_after_mm: error_of(&completed.vertices, true),
            edge_change_median: change.median,
            edge_change_p95: change.p95,
            true_edge_change_p95: true_change.p95,
            flipped: flipped(self.welding.mesh(), &self.welding.weld(&completed.vertices)),
            true_flipped: flipped(self.welding.mesh(), &welded_truth),
            iterations: completed.report.iterations,
        };
        Ok(Some(Completed {
            report,
            view,
            points,
            vertices: completed.vertices,
        }))
    }

    fn report(&self, without_vertices: u64, per_frame: Vec<FrameReport>) -> Result<ObjectReport> {
        let rows = BINS.windows(2).filter_map(|bin| {
            let hidden_share = [bin[0], bin[1]];
            let frames: Vec<FrameReport> = (per_frame.iter().copied())
                .filter(|frame| (hidden_share[0]..hidden_share[1]).contains(&frame.hidden_share))
                .collect();
            self.row(hidden_share, &frames)
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
    fn row(&self, hidden_share: [f64; 2], frames: &[FrameReport]) -> Option<Row> {
        let median = |of: fn(&FrameReport) -> f64| Summary::of(frames.iter().map(|f| Some(of(f)))).map(|s| s.median);
        let mut errors: Vec<f64> = frames.iter().map(|f| f.arap_mm).collect();
        errors.sort_by(f64::total_cmp);
        let best = frames
            .iter()
            .filter(|f| f.arap_mm < f.rigid_mm.min(f.laplacian_mm))
            .count();
        let arap_mm = median(|f| f.arap_mm)?;
        Some(Row {
            hidden_share,
            frames: frames.len(),
            arap_mm,
            arap_percent: 100.0 * arap_mm / self.extent,
            arap_p95_mm: errors[(errors.len() - 1) * 19 / 20],
            rigid_mm: median(|f| f.rigid_mm)?,
            laplacian_mm: median(|f| f.laplacian_mm)?,
            best_share: best as f64 / frames.len() as f64,
            visible_before_mm: median(|f| f.visible_before_mm)?,
            visible_after_mm: median(|f| f.visible_after_mm)?,
            edge_change_median: median(|f| f.edge_change_median)?,
            edge_change_p95: median(|f| f.edge_change_p95)?,
            true_edge_change_p95: median(|f| f.true_edge_change_p95)?,
            flipped: frames.iter().map(|f| f.flipped).sum(),
            true_flipped: frames.iter().map(|f| f.true_flipped).sum(),
            most_iterations: frames.iter().map(|f| f.iterations).max()?,
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
                rows.push(self.panels(camera, &completed));
            }
        }
        Ok(rows)
    }

    fn panels(&self, camera: &Camera, completed: &Completed) -> sheet::Row {
        let Completed {
            report,
            view,
            points,
            vertices,
        } = completed;
        let truth = &view.vertices_camera;
        let bar = sheet::ColorBar {
            colors: ColorMap::Inferno,
            range: [0.0, ERROR_SCALE_MM],
            unit: "mm",
        };
        let errors_of = |of: &[DVec3]| -> Vec<f64> { of.iter().zip(truth).map(|(a, b)| a.distance(*b)).collect() };
        let mut seen = vec![0.0; truth.len()];
        points.iter().for_each(|p| seen[p.vertex] = 1.0);
        let seen_color = |share: f64| if share > 0.5 { [110, 200, 120] } else { [120, 120, 130] };
        let centre = truth.iter().sum::<DVec3>() / truth.len().max(1) as f64;
        let side = |vertices: &[DVec3]| turned(vertices, centre, SIDE_RAD);
        let panel = |title: &str, picture: Picture, bar: Option<sheet::ColorBar>| sheet::Panel {
            title: title.to_owned(),
            picture: picture.halved(),
            bar,
        };
        let colored =
            |vertices: &[DVec3], values: &[f64]| shaded(&self.mesh, vertices, camera, values, |error| bar.color(error));
        let smooth = laplacian(&self.welding, self.mesh.vertices(), points);
        sheet::Row {
            caption: format!(
                "{} {}: {:.0} % hidden; hidden vertices ARAP {:.1}, rigid {:.1}, Laplacian {:.1} mm; visible {:.2} mm",
                self.name,
                report.index,
                100.0 * report.hidden_share,
                report.arap_mm,
                report.rigid_mm,
                report.laplacian_mm,
                report.visible_after_mm
            ),
            panels: vec![
                panel(
                    "truth, seen green",
                    shaded(&self.mesh, truth, camera, &seen, seen_color),
                    None,
                ),
                panel(
                    "ARAP, error",
                    colored(vertices, &errors_of(vertices)),
                    Some(bar.clone()),
                ),
                panel(
                    "truth from the side",
                    shaded(&self.mesh, &side(truth), camera, &seen, seen_color),
                    None,
                ),
                panel(
                    "ARAP from the side",
                    colored(&side(vertices), &errors_of(vertices)),
                    None,
                ),
                panel("Laplacian, side", colored(&side(&smooth), &errors_of(&smooth)), None),
            ],
        }
    }
}

/// Root mean square of distances; 0 of none.
fn rmse(distances: impl Iterator<Item = f64>) -> f64 {
    let (mut sum, mut count) = (0.0, 0);
    for distance in distances {
        sum += distance * distance;
        count += 1;
    }
    (sum / f64::from(count.max(1))).sqrt()
}

/// Pairs of neighbouring faces that lie folded on each other, normals more than 90 degrees apart.
fn flipped(mesh: &TriangleMesh, vertices: &[DVec3]) -> usize {
    let normals: Vec<DVec3> = mesh
        .faces()
        .iter()
        .map(|&[a, b, c]| (vertices[b] - vertices[a]).cross(vertices[c] - vertices[a]))
        .collect();
    let mut sides: Vec<([usize; 2], usize)> = Vec::new();
    for (face, &[a, b, c]) in mesh.faces().iter().enumerate() {
        sides.extend([[a, b], [b, c], [c, a]].map(|[a, b]| ([a.min(b), a.max(b)], face)));
    }
    sides.sort_unstable();
    sides
        .windows(2)
        .filter(|pair| pair[0].0 == pair[1].0 && normals[pair[0].1].dot(normals[pair[1].1]) < 0.0)
        .count()
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
            "  {:<10}{:>7}{:>9}{:>7}{:>8}{:>8}{:>11}{:>7}{:>9}{:>8}{:>9}{:>8}{:>9}{:>6}",
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
            "iter"
        );
        for row in object.rows.iter().chain([&object.all]) {
            let [low, high] = row.hidden_share.map(|share| 100.0 * share);
            println!(
                "  {:<10}{:>7}{:>9.2}{:>7.2}{:>8.1}{:>8.1}{:>11.1}{:>5.0} %{:>9.2}{:>8.2}{:>9.2}{:>8.2}{:>9}{:>6}",
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
                100.0 * row.best_share,
                row.visible_before_mm,
                row.visible_after_mm,
                100.0 * row.edge_change_median,
                100.0 * row.edge_change_p95,
                row.flipped,
                row.most_iterations
            );
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_face_folded_over_its_neighbour_counts_as_flipped() {
        let corners = [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (1.0, 1.0)].map(|(x, y)| DVec3::new(x, y, 0.0));
        let uv = vec![Default::default(); 4];
        let mesh = TriangleMesh::new(corners.to_vec(), uv, vec![[0, 2, 1], [1, 2, 3]]).unwrap();
        assert_eq!(flipped(&mesh, mesh.vertices()), 0);
        let mut folded = corners.to_vec();
        folded[3] = DVec3::new(0.2, 0.2, 0.1);
        assert_eq!(flipped(&mesh, &folded), 1);
    }

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
            assert!(all.best_share > 0.6, "{}: {}", object.name, all.best_share);
            assert!(all.most_iterations < 10);
        }
    }
}
