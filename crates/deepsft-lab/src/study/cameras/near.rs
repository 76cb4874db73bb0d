//! Objects that are too near for the training camera's angle of view, and not for the camera's: seen in a view that is zoomed out.

use super::scenes::{NamedCamera, Scenes, cameras, cut_off, holds};
use crate::reading;
use anyhow::Result;
use deepsft::{Device, Estimate, Target, TargetFinder, View};
use deepsft_geometry::Camera;
use deepsft_geometry::glam::DVec3;
use deepsft_geometry::metrics::Summary;
use serde::Serialize;
use std::path::Path;

/// Depth of the sheet's centroid, mm.
const DISTANCE_MM: [f64; 2] = [150.0, 500.0];

/// The least fraction of the sheet that the canonical view must cut off.
const MIN_CUT: f64 = 0.2;

/// What came out of the scenes.
#[derive(Default)]
struct Answers {
    found: usize,
    /// RMS distance of all vertices from the true ones in the scenes in which the sheet was found, mm.
    mesh_mm: Vec<f64>,
}

#[derive(Serialize)]
pub struct NearRow {
    camera: &'static str,
    is_upright: bool,
    scenes: usize,
    found: usize,
    mesh_mm_mean: Option<f64>,
    mesh_mm_median: Option<f64>,
}

/// Cameras that see more than the training camera: a web camera of 4 : 3 too.
fn wide_cameras() -> Result<Vec<NamedCamera>> {
    let webcam = Camera::typical((1280, 960))?;
    let webcams = [false, true].map(|is_upright| NamedCamera::held("4:3 webcam", webcam, is_upright));
    let others = cameras()?
        .into_iter()
        .filter(|named| ["kinect-v2", "wide-phone"].contains(&named.name));
    Ok(webcams.into_iter().chain(others).collect())
}

/// Measures `count` scenes of each wide camera in which it sees the whole sheet and the canonical view
/// misses a fifth of it.
pub fn measured(model: &Path, count: u64, seed: u64) -> Result<Vec<NearRow>> {
    let bundle = reading::bundle(model)?;
    let target = Target::from_model(&bundle, &Device::Cpu)?;
    let mut finder = TargetFinder::new(target.clone())?;
    let mut rows = Vec::new();
    for named in wide_cameras()? {
        let camera = named.camera;
        let nearest = target.canonical_camera(camera.size());
        let seen_by = std::slice::from_ref(&named);
        let scenes = Scenes::new(bundle.template(), seen_by, DISTANCE_MM, seed)?;
        let mut answers = Answers::default();
        scenes.each(
            count,
            |vertices| holds(&camera, vertices) && cut_off(&nearest, vertices) >= MIN_CUT,
            |scene| {
                let image = scenes.image(scene, &camera)?;
                let estimate = pollster::block_on(finder.estimate(&mut View::new(&image, &camera)))?;
                answers.add(estimate, &scene.world.vertices_camera);
                Ok(())
            },
        )?;
        let summary = Summary::of(answers.mesh_mm.iter().copied().map(Some));
        rows.push(NearRow {
            camera: named.name,
            is_upright: named.is_upright,
            scenes: count as usize,
            found: answers.found,
            mesh_mm_mean: summary.map(|summary| summary.mean),
            mesh_mm_median: summary.map(|summary| summary.median),
        });
    }
    Ok(rows)
}

impl Answers {
    fn add(&mut self, estimate: Estimate, truth: &[DVec3]) {
        let Some(fit) = estimate.surface.filter(|_| estimate.judgement.found) else {
            return;
        };
        self.found += 1;
        let squares = fit
            .vertices_camera
            .iter()
            .zip(truth)
            .map(|(p, q)| p.distance_squared(*q));
        self.mesh_mm
            .push((squares.sum::<f64>() / truth.len().max(1) as f64).sqrt());
    }
}

pub fn print(rows: &[NearRow]) {
    println!("\n| too near for the canonical view | found | mesh, mm |");
    println!("|---|---|---|");
    for row in rows {
        let held = if row.is_upright { "upright" } else { "across" };
        let mesh = match (row.mesh_mm_mean, row.mesh_mm_median) {
            (Some(mean), Some(median)) => format!("{mean:.1} / **{median:.1}**"),
            _ => "-".to_owned(),
        };
        println!("| {}, {held} | {} of {} | {mesh} |", row.camera, row.found, row.scenes);
    }
}
