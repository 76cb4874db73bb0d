//! Objects that are too near for the training camera's angle of view, and not for the camera's: seen in a view that is zoomed out.

use super::figure::{Figure, figure, mean_and_median};
use super::scenes::{NamedCamera, Scenes, cameras, cut_off, holds};
use crate::reading;
use anyhow::Result;
use deepsft::{Device, Estimate, Target, TargetFinder, View};
use deepsft_geometry::Camera;
use deepsft_geometry::glam::DVec3;
use serde::Serialize;
use std::path::Path;

/// Depth of the sheet's centroid, mm.
const DISTANCE_MM: [f64; 2] = [150.0, 500.0];

/// The least fraction of the sheet that the canonical view must cut off.
const MIN_CUT: f64 = 0.2;

#[derive(Serialize)]
pub struct NearRow {
    camera: String,
    scenes: usize,
    found: usize,
    /// RMS distance of all vertices from the true ones in the scenes in which the sheet was found, mm.
    mesh_mm: Figure,
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
        let mut mesh_mm = Vec::new();
        scenes.each(
            count,
            |vertices| holds(&camera, vertices) && cut_off(&nearest, vertices) >= MIN_CUT,
            |scene| {
                let image = scenes.image(scene, &camera)?;
                let estimate = pollster::block_on(finder.estimate(&mut View::new(&image, &camera)))?;
                mesh_mm.extend(mesh_error_mm(estimate, &scene.world.vertices_camera));
                Ok(())
            },
        )?;
        rows.push(NearRow {
            camera: named.to_string(),
            scenes: count as usize,
            found: mesh_mm.len(),
            mesh_mm: mean_and_median(mesh_mm.into_iter().map(Some)),
        });
    }
    Ok(rows)
}

/// `None` where the sheet was not found.
fn mesh_error_mm(estimate: Estimate, truth: &[DVec3]) -> Option<f64> {
    let fit = estimate.surface.filter(|_| estimate.judgement.found)?;
    let pairs = fit.vertices_camera.iter().zip(truth);
    let squares = pairs.map(|(p, q)| p.distance_squared(*q)).sum::<f64>();
    Some((squares / truth.len().max(1) as f64).sqrt())
}

pub fn print(rows: &[NearRow]) {
    println!("\n| too near for the canonical view | found | mesh, mm |");
    println!("|---|---|---|");
    for row in rows {
        let mesh = figure(row.mesh_mm, 1);
        println!("| {} | {} of {} | {mesh} |", row.camera, row.found, row.scenes);
    }
}
