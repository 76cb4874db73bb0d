//! Objects that are too near for the training camera's angle of view, and not for the camera's: in the canonical view alone, and in the
//! nearest view that holds them.

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

/// What came out of one view of each scene.
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
    canonical: Near,
    zoomed: Near,
}

#[derive(Serialize)]
struct Near {
    found: usize,
    mesh_mm_mean: Option<f64>,
    mesh_mm_median: Option<f64>,
}

/// Cameras that see more than the training camera: a web camera of 4 : 3 too.
fn wide_cameras() -> Result<Vec<NamedCamera>> {
    let webcam = Camera::typical((1280, 960))?;
    let webcams = [false, true].map(|is_upright| NamedCamera {
        name: "4:3 webcam",
        is_upright,
        camera: if is_upright {
            webcam.turned_anticlockwise()
        } else {
            webcam
        },
    });
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
        let (mut canonical, mut zoomed) = (Answers::default(), Answers::default());
        scenes.each(
            count,
            |vertices| holds(&camera, vertices) && cut_off(&nearest, vertices) >= MIN_CUT,
            |scene| {
                let image = scenes.image(scene, &camera)?;
                let mut view = View::new(&image, &camera);
                canonical.add(
                    pollster::block_on(finder.estimate_in(&mut view, &nearest))?,
                    &scene.world.vertices_camera,
                );
                zoomed.add(
                    pollster::block_on(finder.estimate(&mut view))?,
                    &scene.world.vertices_camera,
                );
                Ok(())
            },
        )?;
        rows.push(NearRow {
            camera: named.name,
            is_upright: named.is_upright,
            scenes: count as usize,
            canonical: canonical.summary(),
            zoomed: zoomed.summary(),
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

    fn summary(&self) -> Near {
        let summary = Summary::of(self.mesh_mm.iter().copied().map(Some));
        Near {
            found: self.found,
            mesh_mm_mean: summary.map(|summary| summary.mean),
            mesh_mm_median: summary.map(|summary| summary.median),
        }
    }
}

pub fn print(rows: &[NearRow]) {
    println!("\n| too near for the canonical view | canonical view: found | mesh, mm | zoomed out: found | mesh, mm |");
    println!("|---|---|---|---|---|");
    let millimetres = |near: &Near| match (near.mesh_mm_mean, near.mesh_mm_median) {
        (Some(mean), Some(median)) => format!("{mean:.1} / **{median:.1}**"),
        _ => "-".to_owned(),
    };
    for row in rows {
        let held = if row.is_upright { "upright" } else { "across" };
        println!(
            "| {}, {held} | {} of {} | {} | {} of {} | {} |",
            row.camera,
            row.canonical.found,
            row.scenes,
            millimetres(&row.canonical),
            row.zoomed.found,
            row.scenes,
            millimetres(&row.zoomed),
        );
    }
}
