//! `deepsft-lab study blender`: how exact the fit is on frames of another renderer, with the truth beside each.

use super::frames::cell;
use crate::measuring::{Spread, median, write_json};
use crate::reading;
use anyhow::{Context, Result, ensure};
use clap::Args;
use deepsft::{Estimate, Target, TargetFinder, View};
use deepsft_formats::{CAMERA_FILE, read_camera};
use deepsft_geometry::glam::{DVec2, DVec3};
use deepsft_geometry::{Camera, Maps, TriangleMesh, metrics, raster::VisibleSurface};
use indicatif::ProgressBar;
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};
use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

/// A frame is right with a median registration error below this, pixels of the canonical image.
const RIGHT_PX: f64 = 2.0;

const ERRORS: [&str; 3] = ["registration_median_px", "points_rmse_mm", "vertices_rmse_mm"];

#[derive(Args)]
#[command(after_help = "\
DIR is what crates/deepsft-lab/blender/render_sheets.py writes. Features look in each frame for its print, and for the next one.
Right: found, and the median registration error over the visible sheet is below 2 px of the canonical image (480 x 270).
Errors of right frames, median (95th percentile): that median; RMSE of the visible 3D points; RMSE of all vertices of the mesh.")]
pub struct BlenderArguments {
    /// Folder of rendered frames
    #[arg(value_name = "DIR")]
    frames: PathBuf,
    /// Write the figures of every frame to this file
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
}

/// What the renderer says of a frame.
#[derive(Deserialize, Serialize)]
struct Scene {
    print: String,
    size_mm: [f64; 2],
    grid: [usize; 2],
    #[serde(flatten)]
    rest: Value,
}

/// A frame, and what features and fit make of it.
#[derive(Serialize)]
struct Frame {
    name: PathBuf,
    #[serde(flatten)]
    scene: Scene,
    found: bool,
    right: bool,
    /// Whether the next print is found in it.
    false_find: bool,
    explained: f32,
    /// [`ERRORS`]; the first is missing where less than half of the visible sheet has a registration.
    errors: BTreeMap<&'static str, f64>,
}

pub fn run(arguments: &BlenderArguments) -> Result<()> {
    let folder = &arguments.frames;
    let (mut scenes, mut finders) = (BTreeMap::new(), BTreeMap::new());
    for entry in fs::read_dir(folder).with_context(|| folder.display().to_string())? {
        let name = PathBuf::from(entry?.file_name());
        let about = fs::read(folder.join(&name).join("frame.json"));
        let Ok(about) = about else { continue };
        let scene: Scene = serde_json::from_slice(&about).with_context(|| name.display().to_string())?;
        if !finders.contains_key(&scene.print) {
            let picture = reading::picture(&folder.join("prints").join(&scene.print))?;
            let target = Target::from_picture(picture, scene.size_mm[0])?;
            finders.insert(scene.print.clone(), TargetFinder::new(target)?);
        }
        scenes.insert(name, scene);
    }
    ensure!(finders.len() > 1, "two prints are needed: another is looked for too");
    let progress = ProgressBar::new(scenes.len() as u64);
    let mut frames = Vec::new();
    for (name, scene) in scenes {
        let folder = folder.join(&name);
        let camera = read_camera(&folder.join(CAMERA_FILE))?;
        let image = reading::picture(&folder.join("image.png"))?;
        let mut view = View::new(&image, &camera);
        let next = finders.keys().find(|print| **print > scene.print);
        let next = next.or(finders.keys().next()).cloned().unwrap_or_default();
        let mut look = |print: &str| -> Result<Estimate> {
            let finder = finders.get_mut(print).context("every print has a finder")?;
            Ok(pollster::block_on(finder.estimate(&mut view))?)
        };
        let (estimate, other) = (look(&scene.print)?, look(&next)?);
        let truth = Truth::read(&folder, scene.grid, &camera, &estimate.canonical_camera)
            .with_context(|| folder.display().to_string())?;
        let errors = errors(&estimate, finders[&scene.print].target(), &truth)?;
        frames.push(Frame {
            found: estimate.judgement.found,
            right: estimate.judgement.found && errors.get(ERRORS[0]).is_some_and(|error| *error < RIGHT_PX),
            false_find: other.judgement.found,
            explained: estimate.judgement.confidence,
            errors,
            name,
            scene,
        });
        progress.inc(1);
    }
    println!("| scenes | frames | found | right | false finds | registration, px | 3D, mm | mesh, mm |");
    println!("|---|---|---|---|---|---|---|---|");
    print("all", frames.iter());
    for group in ["material", "light", "shape"] {
        let of = |frame: &Frame| frame.scene.rest[group].as_str().unwrap_or("-").to_owned();
        for value in frames.iter().map(of).collect::<BTreeSet<_>>() {
            let scenes = format!("{group}: {value}");
            print(&scenes, frames.iter().filter(|frame| of(frame) == value));
        }
    }
    let report = json!({"frames": frames, "deepsft_version": env!("CARGO_PKG_VERSION")});
    write_json(arguments.json.as_deref(), &report)
}

/// The true surface of a frame, a fine grid, and what the image shows of it.
struct Truth {
    mesh: TriangleMesh,
    cells: DVec2,
    maps: Maps,
}

impl Truth {
    /// Reads that of the frame in `folder`, which `camera` took; maps of `canonical`.
    fn read(folder: &Path, [columns, rows]: [usize; 2], camera: &Camera, canonical: &Camera) -> Result<Self> {
        let npy = fs::read(folder.join("surface.npy"))?;
        let values = npy[npy.len().saturating_sub(12 * columns * rows)..].as_chunks().0;
        let values: Vec<f64> = values.iter().map(|&value| f32::from_le_bytes(value).into()).collect();
        let vertices = values.as_chunks().0.iter().map(|&point| DVec3::from_array(point));
        let cells = DVec2::new(columns as f64 - 1.0, rows as f64 - 1.0);
        let uvs = (0..rows * columns).map(|k| DVec2::new((k % columns) as f64, (k / columns) as f64) / cells);
        let corners = (0..columns * (rows - 1)).filter(|a| a % columns + 1 < columns);
        let faces = corners.flat_map(|a| [[a, a + columns, a + columns + 1], [a, a + columns + 1, a + 1]]);
        let mesh = TriangleMesh::new(vertices.collect(), uvs.collect(), faces.collect())?;
        let mut maps = VisibleSurface::new(&mesh, mesh.vertices(), canonical).maps();
        let visible = reading::picture(&folder.join("visible.png"))?;
        let (width, limit) = (maps.size().width, camera.size().as_dvec2());
        for pixel in 0..maps.depth().len() {
            let centre = DVec2::new((pixel % width) as f64 + 0.5, (pixel / width) as f64 + 0.5);
            let at = camera.pixel_from_ray(canonical.ray_from_pixel(centre));
            let at = at.filter(|at| *at == at.clamp(DVec2::ZERO, limit));
            if !at.is_some_and(|at| visible.sample(at.x, at.y)[0] > 254.0) {
                maps.clear(pixel);
            }
        }
        Ok(Self { mesh, cells, maps })
    }

    /// The point of the surface at (u, v), mm, camera frame.
    fn at(&self, uv: DVec2) -> DVec3 {
        let cell = (uv * self.cells).floor().min(self.cells - 1.0);
        let (at, columns) = (uv * self.cells - cell, self.cells.x as usize + 1);
        let first = cell.y as usize * columns + cell.x as usize;
        let along = |k: usize| self.mesh.vertices()[k].lerp(self.mesh.vertices()[k + 1], at.x);
        along(first).lerp(along(first + columns), at.y)
    }
}

fn errors(estimate: &Estimate, target: &Target, truth: &Truth) -> Result<BTreeMap<&'static str, f64>> {
    let (maps, camera, size_mm) = (&estimate.maps, &estimate.canonical_camera, target.template().size_mm());
    // The pixels of a view that is zoomed out are larger.
    let scale = target.canonical_camera(camera.size()).focal().x / camera.focal().x;
    let error = |pixel: usize| match maps.inside(pixel) {
        true => Some(scale * metrics::registration_error_px(maps, &truth.maps, camera, pixel, size_mm)?.length()),
        false => Some(f64::INFINITY),
    };
    let visible = (0..truth.maps.depth().len()).filter(|&pixel| truth.maps.inside(pixel));
    let registration = median(visible.filter_map(error)).filter(|error| error.is_finite());
    let points = metrics::frame_metrics(maps, &truth.maps, camera, size_mm)?.points_rmse_mm;
    let vertices = estimate.surface.iter().flat_map(|surface| &surface.vertices_camera);
    let pairs = target.template().mesh().texture_coordinates().iter().zip(vertices);
    let squares = metrics::Summary::of(pairs.map(|(&uv, &vertex)| Some(truth.at(uv).distance_squared(vertex))));
    let all = [registration, points, squares.map(|squares| squares.mean.sqrt())];
    let all = ERRORS.into_iter().zip(all);
    Ok(all.filter_map(|(name, error)| Some((name, error?))).collect())
}

fn print<'a>(scenes: &str, frames: impl Iterator<Item = &'a Frame> + Clone) {
    let count = |holds: fn(&Frame) -> bool| frames.clone().filter(|frame| holds(frame)).count();
    let [found, right] = [count(|frame| frame.found), count(|frame| frame.right)];
    let [all, wrong] = [count(|_| true), count(|frame| frame.false_find)];
    print!("| {scenes} | {all} | {found} | {right} | {wrong} |");
    for name in ERRORS {
        let right = frames.clone().filter(|frame| frame.right);
        let errors = right.filter_map(|frame| frame.errors.get(name).copied());
        print!(" {} |", cell(Spread::of(errors)));
    }
    println!();
}
