//! `deepsft reconstruct`: the template in photographs.

use crate::camera_choice::{self, CameraReport, camera_of, origin};
use crate::failure::{self, usage};
use crate::mesh_choice::MeshChoice;
use crate::object_choice::{ChosenFinder, FinderChoice};
use crate::output::flat::flat_files;
use crate::output::{panels, sheet};
use crate::{input, progress};
use anyhow::{Context, Result};
use clap::{Args, ValueEnum};
use deepsft::{DeviceKind, Estimate, FinderKind, Judgement, TargetFinder, encode_png};
use deepsft_formats::{FolderKind, StagedFolder};
use deepsft_geometry::{
    CalibratedCamera, Camera, Maps, MeshRecovery, Picture, Surface, TriangleMesh, photo_consistency_error,
    visible_surface,
};
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
        "flat.png",
        "flat-confidence.png",
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
  whole-mesh.glb    the whole object, hidden parts included (not with --mesh none)
  flat.png          with --flat: the print as photographed, laid flat, white where the image does not show it
  flat-confidence.png  how much the image shows of each of its pixels, 255 for all that there is to see
  report.json       whether the object was found, how sure that is, the cameras, the time of each stage

Maps belong to the canonical 480 x 270 image; report.json has its camera, zoomed out for an object that is too near. Of an upright photograph
all stand upright: 480 rows of 270. With --maps image they have a value for each pixel of the photograph as it is, lens included: the fitted
mesh is drawn there, and the arrays have its rows and columns. Without --camera the focal length is what a tilted or bent sheet tells, or else the
photograph's EXIF data, or else that of a typical phone: depths are wrong by the same fraction as it is. The line of each image says which. deepsft camera calibrate makes a camera file.

Each image has one line. One that cannot be used does not stop the others; the exit code is 3 then.

A picture needs no training: its corners are found in the image. A model has its own network, which also sees what has
hardly any corners. --mesh fit fits the template's mesh to what was found and then to the image, and the agreement of both
tells whether the object is there. The maps become those of the mesh.

--mesh none gives a network's own maps. --mesh complete keeps them and recovers the hidden rest as rigidly as possible
(ARAP, as in the paper); it corrects nothing that is seen. Both need a model.

A camera file holds pixels, and the distortion in OpenCV's order:
  {\"width\": 1920, \"height\": 1080, \"fx\": 1400.0, \"fy\": 1400.0, \"cx\": 960.0, \"cy\": 540.0,
   \"distortion\": [0.0, 0.0, 0.0, 0.0, 0.0]}
or the four numbers of OpenCV's fisheye in \"fisheye\".

cx and cy count from the image's corner: the first pixel's centre is (0.5, 0.5). OpenCV, ROS and TUM count from
that centre: for their numbers add \"pixel_centers\": \"integer\" to the file, or half a pixel to cx and cy.

Examples:
  deepsft reconstruct --picture cover.jpg --size-mm 210x297 --camera camera.json --out results a.jpg b.jpg
  deepsft reconstruct --model models/poster-a4 --camera camera.json --out results a.jpg b.jpg")]
pub struct ReconstructArguments {
    #[command(flatten)]
    finder: FinderChoice,
    /// Intrinsics of the camera that took the images; may be for another size of the same aspect ratio. Or one of the paper's
    /// cameras: kinect-v2, realsense-d435, gopro-hero3
    #[arg(long, value_name = "FILE")]
    camera: Option<PathBuf>,
    /// Folder to write; results of the same images there are replaced
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// How to find the whole mesh [default: fit]
    #[arg(long, value_name = "HOW", value_enum)]
    mesh: Option<MeshChoice>,
    /// Whose pixels the maps have
    #[arg(long, value_name = "WHOSE", value_enum, default_value = "canonical")]
    maps: MapsOf,
    /// Lay the photographed print flat too, so many pixels wide: flat.png
    #[arg(long, value_name = "PX", value_parser = clap::value_parser!(u16).range(16..=8192))]
    flat: Option<u16>,
    /// Divide shadows, uneven light and its colour out of flat.png
    #[arg(long, requires = "flat")]
    unshaded: bool,
    /// What computes: cpu, or webgpu if the program was built with it
    #[arg(long, value_name = "DEVICE", default_value_t = DeviceKind::Cpu)]
    device: DeviceKind,
    /// Images (PNG, JPEG, WebP, ...)
    #[arg(value_name = "IMAGE", required = true)]
    images: Vec<PathBuf>,
}

/// The image that maps belong to.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum, Serialize)]
#[serde(rename_all = "lowercase")]
enum MapsOf {
    /// The 480 x 270 pixels that finders see
    Canonical,
    /// Every pixel of the photograph
    Image,
}

/// The content of `report.json`.
#[derive(Serialize)]
struct Report {
    image: String,
    /// The model's name, or the path of the picture or template.
    object: String,
    found: bool,
    /// Who found it, or saw something that was not it: `network`, `features` or `descriptors`.
    found_by: Option<FinderKind>,
    /// 0 to 1: how well the template explains the image.
    confidence: f32,
    /// Whether the image determines the shape, and not only that the object is there.
    shape_determined: bool,
    /// Median and 95th percentile of the standard deviations of the mesh's vertices, mm; null where they are not known.
    deviation_mm: Option<[f32; 2]>,
    /// Fraction of the canonical image that the object covers.
    mask_area: f32,
    /// Whether the maps are those of a mesh; absent when none was asked for. False when the object was not found or too little of it
    /// is seen for a mesh.
    #[serde(skip_serializing_if = "Option::is_none")]
    mesh_taken: Option<bool>,
    /// Least, median and greatest depth, mm.
    depth_mm: Option<[f32; 3]>,
    /// The paper's E_pr, intensities 0 to 1, not corrected for light.
    photo_consistency_error: Option<f64>,
    /// The camera that the image was taken for.
    camera: CameraReport,
    /// The camera of the canonical image, which the maps belong to unless `maps` says `image`.
    canonical_camera: CameraReport,
    /// `canonical`, or `image`: the maps belong to the photograph and `camera`.
    maps: MapsOf,
    /// What the network ran on; null without one.
    device: Option<String>,
    stage_ms: Stages,
    deepsft_version: &'static str,
}

pub fn run(arguments: &ReconstructArguments) -> Result<()> {
    let folders = folders(&arguments.out, &arguments.images)?;
    let camera = arguments.camera.as_deref().map(camera_choice::read).transpose()?;
    let mesh = arguments.mesh.unwrap_or(MeshChoice::Fit);
    let needless = match mesh {
        MeshChoice::None | MeshChoice::Complete if !arguments.finder.has_model() => {
            Some("--mesh none and complete are about a network's maps: they need --model")
        }
        MeshChoice::None if arguments.flat.is_some() => Some("--flat lays a mesh flat, and --mesh none asks for none"),
        MeshChoice::None if arguments.maps == MapsOf::Image => {
            Some("--maps image draws a mesh in the photograph, and --mesh none asks for none")
        }
        _ => None,
    };
    if let Some(reason) = needless {
        return Err(usage(reason));
    }
    let chosen = arguments.finder.finder(arguments.device)?;
    let template = chosen.finder.target().template();
    let mut object = Object {
        maps_of: arguments.maps,
        flat_width: arguments.flat.map(usize::from),
        unshaded: arguments.unshaded,
        recovery: match mesh {
            MeshChoice::Fit => None,
            other => Some(other.prepare(template)?),
        },
        texture_png: encode_png(template.texture())?,
        chosen,
    };
    let bar = progress::counting(arguments.images.len() as u64, "images");
    let mut failures = Vec::new();
    for (image, folder) in arguments.images.iter().zip(&folders) {
        bar.set_message(image.display().to_string());
        // One bad image does not keep the others from being tried.
        let outcome = object.reconstruct(image, camera.as_ref().zip(arguments.camera.as_deref()), folder);
        bar.suspend(|| match &outcome {
            Ok(line) => println!("{line}"),
            Err(error) => failure::tell(error),
        });
        failures.extend(outcome.err());
        bar.inc(1);
    }
    bar.finish_and_clear();
    failure::ended(&failures)
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

/// An object ready to be found in one image after the other.
struct Object {
    chosen: ChosenFinder,
    /// Without a fit: what to do with the network's maps, if anything.
    recovery: Option<Option<MeshRecovery>>,
    maps_of: MapsOf,
    flat_width: Option<usize>,
    unshaded: bool,
    texture_png: Vec<u8>,
}

impl Object {
    /// Reconstructs one image and returns a line about it.
    fn reconstruct(&mut self, path: &Path, camera: Option<(&Camera, &Path)>, folder: &Path) -> Result<String> {
        let mut stages = Stages::default();
        let photograph = timed(&mut stages, "decode", || input::photograph(path))?;
        let (image, quarters) = (photograph.picture, photograph.quarters);
        let (assumed, source) = camera_of(&image, quarters, camera, photograph.exif)?;
        let results = StagedFolder::new(folder, &RESULTS_FOLDER)?;
        let (estimate, told) = match &mut self.recovery {
            // The finder fits by itself.
            None => timed(&mut stages, "find_and_fit", || {
                let estimated = self
                    .chosen
                    .finder
                    .estimate_with_camera(&image, &assumed, origin(source));
                pollster::block_on(estimated)
            })?,
            Some(recovery) => {
                let estimate = network_only(&self.chosen.finder, recovery.as_mut(), &image, &assumed, &mut stages)?;
                (estimate, None)
            }
        };
        let camera = told.as_ref().map_or(assumed, |told| told.camera);
        let template = self.chosen.finder.target().template();
        let asks_for_mesh = match &self.recovery {
            None => true,
            Some(recovery) => recovery.is_some(),
        };
        // What was not found is shown as the finder saw it, and no mesh of it.
        let judgement = &estimate.judgement;
        let surface = estimate.surface.as_ref().filter(|_| judgement.found);
        let whole = surface.map(|surface| Ok::<_, anyhow::Error>((surface, surface.mesh(template.mesh())?)));
        let whole = whole.transpose()?;
        let report = Report {
            image: path.display().to_string(),
            object: self.chosen.name.clone(),
            found: judgement.found,
            found_by: estimate.by,
            confidence: judgement.confidence,
            shape_determined: judgement.shape_determined,
            deviation_mm: surface.and_then(deviation_range),
            mask_area: judgement.area,
            mesh_taken: asks_for_mesh.then_some(whole.is_some()),
            depth_mm: depth_range(&estimate.maps),
            photo_consistency_error: photo_consistency_error(&estimate.canonical, template.texture(), &estimate.maps),
            camera: told
                .as_ref()
                .map_or_else(|| CameraReport::new(&camera, source), CameraReport::told),
            canonical_camera: CameraReport::new(&estimate.canonical_camera, "model"),
            maps: self.maps_of,
            device: self.chosen.device.as_ref().map(ToString::to_string),
            stage_ms: stages,
            deepsft_version: env!("CARGO_PKG_VERSION"),
        };
        let mut files = self.files(&estimate, whole.as_ref())?;
        if self.maps_of == MapsOf::Image {
            // Of what was not found there is no mesh, and the maps are empty.
            let drawn = surface.map(|surface| surface.maps_in(&camera, template.mesh()));
            files.extend(map_files(&drawn.unwrap_or_else(|| Maps::empty(camera.size())))?);
        }
        if let (Some(width), Some(surface)) = (self.flat_width, surface) {
            let flat = surface.flatten(template, (&image, &camera), width)?;
            files.extend(flat_files(&flat, self.unshaded.then(|| template.texture()))?);
        }
        files.insert(REPORT_FILE, serde_json::to_vec_pretty(&report)?);
        results.filled(&files)?.commit()?;
        let (verdict, camera) = (verdict(judgement), words(&assumed, source, told.as_ref()));
        Ok(format!("{}: {verdict}{camera}: {}", path.display(), folder.display()))
    }

    /// The results by file name, all but the report.
    fn files(
        &self,
        estimate: &Estimate,
        whole: Option<&(&Surface, TriangleMesh)>,
    ) -> Result<BTreeMap<&'static str, Vec<u8>>> {
        let (maps, canonical) = (&estimate.maps, &estimate.canonical);
        let template = self.chosen.finder.target().template();
        let overlay = panels::overlay("registration", canonical, maps, template.size_mm());
        let difference =
            panels::photometric_difference("difference, light fitted", canonical, template.texture(), maps);
        let mut rows = vec![
            sheet::Row::new(
                verdict(&estimate.judgement),
                [panels::plain("input", canonical), overlay],
            ),
            sheet::Row::new("", [panels::depth("depth", maps), difference]),
        ];
        if let Some((surface, _)) = whole.filter(|(surface, _)| !surface.deviations.is_empty()) {
            let deviation = panels::deviation("standard deviation", surface, template.mesh());
            rows.push(sheet::Row::new("", [deviation]));
        }
        let sheet = sheet::sheet(&rows).context("a sheet has panels")?;
        let mesh = visible_surface(maps, &estimate.canonical_camera)?;
        let mut files = BTreeMap::from([
            ("sheet.png", encode_png(&sheet)?),
            ("mesh.glb", deepsft_formats::mesh_to_glb(&mesh, &self.texture_png, &[])),
        ]);
        files.extend(whole.map(|(surface, mesh)| {
            let glb = deepsft_formats::mesh_to_glb(mesh, &self.texture_png, &surface.deviations);
            ("whole-mesh.glb", glb)
        }));
        files.extend(map_files(maps)?);
        Ok(files)
    }
}

/// Maps as NumPy arrays, by file name.
fn map_files(maps: &Maps) -> Result<[(&'static str, Vec<u8>); 3]> {
    let columns = maps.size().width;
    let (depth, registration) = (
        maps.depth().iter().copied(),
        maps.registration().iter().flatten().copied(),
    );
    Ok([
        ("depth.npy", deepsft_formats::f32_npy(&[columns], depth)?),
        (
            "registration.npy",
            deepsft_formats::f32_npy(&[columns, 2], registration)?,
        ),
        ("mask.npy", deepsft_formats::bool_npy(&[columns], maps.mask())?),
    ])
}

/// The object by its network's own maps, completed if that is asked for.
fn network_only(
    finder: &TargetFinder,
    recovery: Option<&mut MeshRecovery>,
    image: &Picture,
    camera: &Camera,
    stages: &mut Stages,
) -> Result<Estimate> {
    let network = finder.target().network().context("the model has a network")?;
    let began = Instant::now();
    let clock_ms = || began.elapsed().as_secs_f64() * 1000.0;
    let (mut estimate, times) = pollster::block_on(network.estimate_timed(image, camera, clock_ms))?;
    stages.extend([
        ("canonical_warp", times.warp_ms),
        ("network", times.network_ms),
        ("confidence", times.judge_ms),
    ]);
    if !estimate.judgement.found {
        estimate.by = None;
    } else if let Some(recovery) = recovery {
        let (canonical, camera) = (&estimate.canonical, &estimate.canonical_camera);
        estimate.surface = timed(stages, "mesh", || recovery.recover(canonical, camera, &estimate.maps))?;
        if let Some(surface) = &estimate.surface {
            let mesh = finder.target().template().mesh();
            estimate.maps = surface.maps(mesh).within(&estimate.maps);
        }
    }
    Ok(estimate)
}

/// Whether the object was found and how sure that is, for people.
fn verdict(judgement: &Judgement) -> String {
    let found = if judgement.found { "found" } else { "not found" };
    let shape = if judgement.shape_determined {
        ", shape determined"
    } else {
        ""
    };
    format!("{found}, confidence {:.2}{shape}", judgement.confidence)
}

/// Where the camera comes from, where nobody gave it.
fn words(assumed: &Camera, source: &str, told: Option<&CalibratedCamera>) -> String {
    let from = match source {
        "exif" => "from EXIF",
        "assumed" => "assumed (a typical phone)",
        _ => return String::new(),
    };
    let focal = assumed.focal().x;
    let focal = match told {
        Some(told) => {
            let (told, percent) = (told.camera.focal().x, 100.0 * told.focal_deviation);
            format!(", f = {told:.0} px (+- {percent:.0} %) by the sheet, {focal:.0} {from}")
        }
        None => format!(", f = {focal:.0} px {from}"),
    };
    match origin(source).is_cropped(assumed.size()) {
        true => focal + ", the photograph was cropped",
        false => focal,
    }
}

/// Least, median and greatest depth inside the mask, mm.
fn depth_range(maps: &Maps) -> Option<[f32; 3]> {
    let inside = (0..maps.depth().len()).filter(|&p| maps.inside(p));
    let mut depths: Vec<f32> = inside.map(|p| maps.depth()[p]).collect();
    depths.sort_unstable_by(f32::total_cmp);
    Some([*depths.first()?, depths[depths.len() / 2], *depths.last()?])
}

/// Median and 95th percentile of a surface's standard deviations, mm.
fn deviation_range(surface: &Surface) -> Option<[f32; 2]> {
    let mut deviations = surface.deviations.clone();
    deviations.sort_unstable_by(f32::total_cmp);
    let percentile = |percent: usize| deviations.get(deviations.len() * percent / 100).copied();
    Some([percentile(50)?, percentile(95)?])
}

/// Milliseconds of each stage.
type Stages = BTreeMap<&'static str, f64>;

/// Does some work and notes its wall time.
fn timed<T>(stages: &mut Stages, stage: &'static str, work: impl FnOnce() -> T) -> T {
    let start = Instant::now();
    let done = work();
    stages.insert(stage, start.elapsed().as_secs_f64() * 1000.0);
    done
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_depth_range_is_over_the_mask() {
        let mut maps = Maps::empty((10, 1));
        assert_eq!(depth_range(&maps), None);
        for (pixel, depth) in [(1, 300.0), (4, 500.0), (9, 310.0)] {
            maps.set(pixel, depth, [0.5; 2]);
        }
        assert_eq!(depth_range(&maps), Some([300.0, 310.0, 500.0]));
    }
}
