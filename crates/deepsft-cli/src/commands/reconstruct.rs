//! `deepsft reconstruct`: the template in photographs.

use crate::camera_choice::{CameraReport, camera_of};
use crate::failure::{self, usage};
use crate::mesh_choice::MeshChoice;
use crate::output::{panels, sheet};
use crate::{input, progress};
use anyhow::{Context, Result};
use clap::Args;
use deepsft::{DeviceDescription, DeviceKind, Estimator, Judgement, ModelBundle, encode_png};
use deepsft_formats::FolderKind;
use deepsft_geometry::{Camera, Maps, MeshRecovery, Picture, TriangleMesh, photo_consistency_error, visible_surface};
use serde::Serialize;
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::time::Instant;

/// Name of the report, by which a folder of results is known.
const REPORT_FILE: &str = "report.json";

/// The folder of an image's results.
const RESULTS_FOLDER: FolderKind = FolderKind {
    known_by: &[REPORT_FILE],
    files: &[
        REPORT_FILE,
        "depth.npy",
        "registration.npy",
        "mask.npy",
        "sheet.png",
        "mesh.glb",
        "whole-mesh.glb",
    ],
};

#[derive(Args)]
#[command(after_help = "\
The command writes for each image DIR/<name of the image>/ with
  depth.npy         f32 [270, 480]: depth in mm (z of the camera frame), -1 where the object is not seen
  registration.npy  f32 [270, 480, 2]: place on the template, (0, 0) its top left corner, (1, 1) its bottom
                    right one; -1 where the object is not seen
  mask.npy          bool [270, 480]: where the object is seen
  sheet.png         input, a checkerboard laid on the object, depth, difference to the template
  mesh.glb          the visible surface with the template's picture; metres, y up, as the camera saw it
  whole-mesh.glb    with --mesh fit or complete: the whole object, hidden parts included
  report.json       whether the object was found, how sure that is, the cameras, the time of each stage

Maps belong to the canonical 480 x 270 image; report.json has its camera. Without --camera the command assumes a typical
phone: depths are then wrong by the same fraction as the focal length.

--mesh fit fits the template's mesh to the network's maps and then to the image. The maps become those of the mesh, unless
the network's own maps explain the image better. --mesh complete keeps what the network sees and recovers the hidden rest
as rigidly as possible (ARAP, as in the paper); it corrects nothing that is seen.

A camera file holds pixels, and the distortion in OpenCV's order:
  {\"width\": 1920, \"height\": 1080, \"fx\": 1400.0, \"fy\": 1400.0, \"cx\": 960.0, \"cy\": 540.0,
   \"distortion\": [0.0, 0.0, 0.0, 0.0, 0.0]}

cx and cy count from the image's corner: the first pixel's centre is (0.5, 0.5). OpenCV, ROS and TUM count from
that centre: for their numbers add \"pixel_centers\": \"integer\" to the file, or half a pixel to cx and cy.

Example:
  deepsft reconstruct --model models/poster-a4 --camera camera.json --mesh fit --out results a.jpg b.jpg")]
pub struct ReconstructArguments {
    /// Model bundle of the object
    #[arg(long, value_name = "BUNDLE")]
    model: PathBuf,
    /// Intrinsics of the camera that took the images; may be for another size of the same aspect ratio
    #[arg(long, value_name = "FILE")]
    camera: Option<PathBuf>,
    /// Folder to write; results of the same images there are replaced
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// How to find the whole mesh
    #[arg(long, alias = "refine", value_name = "HOW", value_enum, default_value_t = MeshChoice::None)]
    mesh: MeshChoice,
    /// What computes: cpu, or vulkan, webgpu or cuda if the program was built with it
    #[arg(long, value_name = "DEVICE", default_value_t = DeviceKind::Cpu)]
    device: DeviceKind,
    /// Images (PNG or JPEG)
    #[arg(value_name = "IMAGE", required = true)]
    images: Vec<PathBuf>,
}

/// The content of `report.json`.
#[derive(Serialize)]
struct Report {
    image: String,
    model: String,
    found: bool,
    /// 0 to 1: how well the template explains the image.
    confidence: f32,
    /// Fraction of the canonical image that the object covers.
    mask_area: f32,
    /// Whether the maps are those of a mesh; absent when none was asked for. False when the network's own maps explained
    /// the image better or showed too little for a mesh.
    #[serde(skip_serializing_if = "Option::is_none")]
    mesh_taken: Option<bool>,
    /// Least, median and greatest depth, mm.
    depth_mm: Option<[f32; 3]>,
    /// The paper's E_pr, intensities 0 to 1, not corrected for light.
    photometric_error: Option<f64>,
    /// The camera that the image was taken for.
    camera: CameraReport,
    /// The camera of the maps.
    canonical_camera: CameraReport,
    device: String,
    stage_ms: BTreeMap<&'static str, f64>,
    deepsft_version: &'static str,
}

pub fn run(arguments: &ReconstructArguments) -> Result<()> {
    let folders = folders(&arguments.out, &arguments.images)?;
    let camera = arguments
        .camera
        .as_deref()
        .map(deepsft_formats::read_camera)
        .transpose()?;
    let bundle = input::bundle(&arguments.model)?;
    let (estimator, device) = input::estimator(&bundle, arguments.device)?;
    let texture_png = encode_png(bundle.template().texture())?;
    let mut model = Model {
        recovery: arguments.mesh.prepare(bundle.template())?,
        bundle,
        estimator,
        device,
        texture_png,
    };
    let bar = progress::counting(arguments.images.len() as u64, "images");
    let mut failures = Vec::new();
    for (image, folder) in arguments.images.iter().zip(&folders) {
        bar.set_message(image.display().to_string());
        // One bad image does not keep the others from being tried.
        match model.reconstruct(image, camera.as_ref().zip(arguments.camera.as_deref()), folder) {
            Ok(line) => bar.suspend(|| println!("{line}")),
            Err(error) => failures.push(error),
        }
        bar.inc(1);
    }
    bar.finish_and_clear();
    let last = failures.pop();
    for error in &failures {
        eprintln!("error: {}", failure::message(error));
    }
    last.map_or(Ok(()), Err)
}

/// The folder of each image's results, each its own.
fn folders(out: &Path, images: &[PathBuf]) -> Result<Vec<PathBuf>> {
    let mut taken = BTreeSet::new();
    let mut folders = Vec::new();
    for image in images {
        let Some(stem) = image.file_stem() else {
            return Err(usage(format!("{} is not the name of an image", image.display())));
        };
        let folder = out.join(stem);
        if !taken.insert(folder.clone()) {
            let folder = folder.display();
            return Err(usage(format!(
                "two of the images would be written to {folder}: reconstruct them one by one"
            )));
        }
        deepsft_formats::check_folder(&folder, &RESULTS_FOLDER)?;
        folders.push(folder);
    }
    Ok(folders)
}

/// A model ready to be used on one image after the other.
struct Model {
    recovery: Option<MeshRecovery>,
    bundle: ModelBundle,
    estimator: Estimator,
    device: DeviceDescription,
    texture_png: Vec<u8>,
}

impl Model {
    /// Reconstructs one image and returns a line about it.
    fn reconstruct(&mut self, path: &Path, camera: Option<(&Camera, &Path)>, folder: &Path) -> Result<String> {
        let mut stages = Stages::default();
        let image = stages.time("decode", || input::picture(path))?;
        let (camera, source) = camera_of(&image, camera)?;
        let canonical = stages.time("canonical_warp", || self.estimator.canonical_image(&image, &camera))?;
        let mut maps = stages.time("network", || pollster::block_on(self.estimator.infer(&canonical)))?;
        let judgement = stages.time("confidence", || self.estimator.judge(&canonical, &maps))?;
        let mut mesh_taken = self.recovery.as_ref().map(|_| false);
        let mut whole = None;
        if let Some(recovery) = self.recovery.as_mut().filter(|_| judgement.found) {
            let camera = self.estimator.canonical_camera();
            let fitted = stages.time("mesh", || recovery.recover(&canonical, camera, &maps))?;
            if let Some(fitted) = fitted.filter(|fitted| fitted.accepted) {
                mesh_taken = Some(true);
                maps = fitted.maps;
                whole = Some(self.bundle.template().mesh().with_vertices(fitted.vertices_camera)?);
            }
        }
        let report = Report {
            image: path.display().to_string(),
            model: self.bundle.name().to_owned(),
            found: judgement.found,
            confidence: judgement.confidence,
            mask_area: judgement.area,
            mesh_taken,
            depth_mm: depth_range(&maps),
            photometric_error: photo_consistency_error(&canonical, self.bundle.template().texture(), &maps),
            camera: CameraReport::new(&camera, source),
            canonical_camera: CameraReport::new(self.estimator.canonical_camera(), "model"),
            device: self.device.to_string(),
            stage_ms: stages.milliseconds,
            deepsft_version: env!("CARGO_PKG_VERSION"),
        };
        let mut files = self.files(&canonical, &maps, &judgement, whole.as_ref())?;
        files.insert(REPORT_FILE.to_owned(), serde_json::to_vec_pretty(&report)?);
        deepsft_formats::write_folder(folder, &RESULTS_FOLDER, &files)?;
        Ok(format!(
            "{}: {}: {}",
            path.display(),
            verdict(&judgement),
            folder.display()
        ))
    }

    /// The results by file name, all but the report.
    fn files(
        &self,
        canonical: &Picture,
        maps: &Maps,
        judgement: &Judgement,
        whole: Option<&TriangleMesh>,
    ) -> Result<BTreeMap<String, Vec<u8>>> {
        let (rows, columns) = (maps.height(), maps.width());
        let template = self.bundle.template();
        let rows_of_panels = [
            sheet::Row {
                caption: verdict(judgement),
                panels: vec![
                    panels::plain("input", canonical),
                    panels::overlay("registration", canonical, maps, template.size_mm()),
                ],
            },
            sheet::Row {
                caption: String::new(),
                panels: vec![
                    panels::depth("depth", maps),
                    panels::photometric_difference("difference, light fitted", canonical, template.texture(), maps),
                ],
            },
        ];
        let sheet = sheet::sheet(&rows_of_panels).context("a sheet has panels")?;
        let mesh = visible_surface(maps, self.estimator.canonical_camera())?;
        let registration = maps.registration().iter().flatten().copied();
        let mut files = BTreeMap::from([
            (
                "depth.npy".to_owned(),
                deepsft_formats::f32_npy(&[rows, columns], maps.depth().iter().copied()),
            ),
            (
                "registration.npy".to_owned(),
                deepsft_formats::f32_npy(&[rows, columns, 2], registration),
            ),
            (
                "mask.npy".to_owned(),
                deepsft_formats::bool_npy(&[rows, columns], maps.mask()),
            ),
            ("sheet.png".to_owned(), encode_png(&sheet)?),
            (
                "mesh.glb".to_owned(),
                deepsft_formats::textured_glb(&mesh, &self.texture_png),
            ),
        ]);
        if let Some(whole) = whole {
            let glb = deepsft_formats::textured_glb(whole, &self.texture_png);
            files.insert("whole-mesh.glb".to_owned(), glb);
        }
        Ok(files)
    }
}

/// Whether the object was found and how sure that is, for people.
fn verdict(judgement: &Judgement) -> String {
    let found = if judgement.found { "found" } else { "not found" };
    format!("{found}, confidence {:.2}", judgement.confidence)
}

/// Least, median and greatest depth inside the mask, mm.
fn depth_range(maps: &Maps) -> Option<[f32; 3]> {
    let mut depths: Vec<f32> = (0..maps.depth().len())
        .filter(|&p| maps.inside(p))
        .map(|p| maps.depth()[p])
        .collect();
    depths.sort_unstable_by(f32::total_cmp);
    Some([*depths.first()?, depths[depths.len() / 2], *depths.last()?])
}

/// Wall time of each stage.
#[derive(Default)]
struct Stages {
    milliseconds: BTreeMap<&'static str, f64>,
}

impl Stages {
    fn time<T>(&mut self, stage: &'static str, work: impl FnOnce() -> T) -> T {
        let start = Instant::now();
        let done = work();
        self.milliseconds.insert(stage, start.elapsed().as_secs_f64() * 1000.0);
        done
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_depth_range_is_over_the_mask() {
        let mut maps = Maps::empty(10, 1);
        assert_eq!(depth_range(&maps), None);
        for (pixel, depth) in [(1, 300.0), (4, 500.0), (9, 310.0)] {
            maps.set(pixel, depth, [0.5; 2]);
        }
        assert_eq!(depth_range(&maps), Some([300.0, 310.0, 500.0]));
    }
}
