//! `deepsft camera calibrate`: a camera from photographs of a flat target.

use super::board::Squares;
use super::chart;
use super::detection::Detector;
use crate::failure::{BlameInput, usage};
use crate::input;
use crate::numbers::SizeMm;
use crate::object_choice::printed;
use crate::video::Video;
use anyhow::{Context, Result, anyhow, bail};
use clap::{Args, ValueEnum};
use deepsft::encode_png;
use deepsft_formats::{CameraFile, read_template};
use deepsft_geometry::planar_calibration::{CameraModel, PlanarCalibration, PlanarView, calibrate};
use deepsft_geometry::{GeometryError, ImageSize, Picture};
use serde::Serialize;
use std::path::{Path, PathBuf};

/// Views that are solved for; more of a video say nothing new.
const MAX_VIEWS: usize = 60;

/// The calibration takes every frame of photographs, and of a video one in this many.
const VIDEO_STEP: usize = 10;

#[derive(Args)]
#[command(after_help = "\
What to photograph: 10 to 20 pictures of the flat target, tilted by 20 to 40 degrees, each time another way, near enough to
fill half of the image, and over all of them out to its corners. Focus and zoom stay as they are; no blur. A phone must not
crop or turn its pictures between: all have one size.

Targets:
  --charuco 9x6              the board of deepsft camera board: may be partly hidden or cut off
  --checkerboard             any checkerboard, or the part of it that is seen
  --picture P --size-mm S    a print of your own picture, held flat (glass, a table); or --template DIR

It writes the camera, with the calibration's figures (RMS, deviations, each view) under \"calibration\", which other commands
pass over, and beside it a picture: where points were seen, and how far they are from where the camera has them.

Models, with fewer and more unknowns: focal, pinhole, radial (k1 k2), polynomial (k1 k2 p1 p2 k3), and fisheye (OpenCV's, for
lenses that see more than about 100 degrees; never chosen by itself). Without --model the one with the fewest unknowns that
explains the views.

Examples:
  deepsft camera board --out board.pdf
  deepsft camera calibrate --charuco 9x6 --out camera.json photographs/
  deepsft camera calibrate --picture cover.jpg --size-mm 210x297 --out camera.json a.jpg b.jpg c.jpg d.jpg
  deepsft reconstruct --picture cover.jpg --size-mm 210x297 --camera camera.json --out results photo.jpg")]
pub struct CalibrateArguments {
    #[command(flatten)]
    target: TargetChoice,
    /// Printed size of the picture in mm: WIDTHxHEIGHT, or the width alone
    #[arg(long, value_name = "SIZE", requires = "picture")]
    size_mm: Option<SizeMm>,
    /// What is unknown of the camera [default: as little as explains the views]
    #[arg(long, value_name = "MODEL", value_enum)]
    model: Option<ModelChoice>,
    /// Camera file to write; the picture beside it has its name with .png
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
    /// Photographs (PNG or JPEG), a folder of them, or a video
    #[arg(value_name = "INPUT", required = true)]
    inputs: Vec<PathBuf>,
}

#[derive(Args)]
#[group(required = true, multiple = false)]
struct TargetChoice {
    /// ChArUco board with so many squares across and down
    #[arg(long, value_name = "COLUMNSxROWS")]
    charuco: Option<Squares>,
    /// Checkerboard of any size
    #[arg(long)]
    checkerboard: bool,
    /// Picture (PNG or JPEG) whose print lies flat: give --size-mm too
    #[arg(long, value_name = "FILE", requires = "size_mm")]
    picture: Option<PathBuf>,
    /// Folder of a template whose print lies flat
    #[arg(long, value_name = "DIR")]
    template: Option<PathBuf>,
}

#[derive(Clone, Copy, ValueEnum)]
enum ModelChoice {
    /// One focal length; the principal point is the centre
    Focal,
    /// fx, fy, cx, cy
    Pinhole,
    /// ... and k1, k2
    Radial,
    /// ... and k1, k2, p1, p2, k3
    Polynomial,
    /// fx, fy, cx, cy and the k1, k2, k3, k4 of OpenCV's fisheye
    Fisheye,
}

/// The content of the camera file.
#[derive(Serialize)]
struct CalibratedFile {
    #[serde(flatten)]
    camera: CameraFile,
    calibration: Report,
}

#[derive(Serialize)]
struct Report {
    target: &'static str,
    model: String,
    rms_px: f64,
    points: usize,
    points_left_out: usize,
    parameters: Vec<ParameterReport>,
    views: Vec<ViewReport>,
    deepsft_version: &'static str,
}

#[derive(Serialize)]
struct ParameterReport {
    name: &'static str,
    value: f64,
    standard_deviation: f64,
}

#[derive(Serialize)]
struct ViewReport {
    name: String,
    points: usize,
    /// Null for a view that was left out.
    rms_px: Option<f64>,
}

pub fn run(arguments: &CalibrateArguments) -> Result<()> {
    let mut detector = detector(arguments)?;
    let seen = views(&mut detector, &arguments.inputs)?;
    let model = arguments.model.map(|model| match model {
        ModelChoice::Focal => CameraModel::Focal,
        ModelChoice::Pinhole => CameraModel::Pinhole,
        ModelChoice::Radial => CameraModel::Radial,
        ModelChoice::Polynomial => CameraModel::Polynomial,
        ModelChoice::Fisheye => CameraModel::Fisheye,
    });
    let found = calibrate(&seen.views, seen.size, model)
        .map_err(|error| explained(error, &detector, &seen))
        .blame("photographs", &arguments.inputs[0])?;
    let report = report(&detector, seen.names, &found);
    print(&report, &arguments.out, seen.size, model.is_none());
    let file = CalibratedFile {
        camera: CameraFile::new(&found.camera),
        calibration: report,
    };
    let picture = chart::chart(seen.size, &seen.views, &found);
    deepsft_formats::write_file(&arguments.out.with_extension("png"), &encode_png(&picture)?)?;
    deepsft_formats::write_file(&arguments.out, &serde_json::to_vec_pretty(&file)?)?;
    Ok(())
}

fn detector(arguments: &CalibrateArguments) -> Result<Detector> {
    if arguments.out.extension().is_some_and(|extension| extension == "png") {
        return Err(usage(
            "--out is the camera file (camera.json); the picture is written beside it",
        ));
    }
    let target = &arguments.target;
    if let Some(squares) = target.charuco {
        return Detector::charuco(squares);
    }
    if target.checkerboard {
        return Detector::checkerboard();
    }
    if let (Some(file), Some(size)) = (&target.picture, arguments.size_mm) {
        return Detector::print(printed(file, size)?);
    }
    let folder = target.template.as_ref().context("a target is needed")?;
    let template = read_template(folder)?;
    if !template.is_sheet() {
        return Err(anyhow!("it is no flat sheet")).blame("template", folder);
    }
    Detector::print(template)
}

/// What was seen of the target.
struct Seen {
    /// Columns and rows of all photographs.
    size: ImageSize,
    views: Vec<PlanarView>,
    /// Their files, or the numbers of their frames.
    names: Vec<String>,
    /// How many photographs were looked at.
    photographs: usize,
}

fn views(detector: &mut Detector, inputs: &[PathBuf]) -> Result<Seen> {
    let mut seen: Option<Seen> = None;
    let mut look = |name: String, picture: &Picture| -> Result<()> {
        let size = picture.size();
        let seen = seen.get_or_insert(Seen {
            size,
            views: Vec::new(),
            names: Vec::new(),
            photographs: 0,
        });
        if size != seen.size {
            bail!(
                "it has {size} pixels, those before it {}: one camera at one zoom, held one way",
                seen.size
            );
        }
        seen.photographs += 1;
        match detector.detect(picture)? {
            Some(view) => {
                println!("{name}: {} points", view.points.len());
                seen.views.push(view);
                seen.names.push(name);
            }
            None => println!("{name}: no {}", detector.name()),
        }
        Ok(())
    };
    for path in inputs {
        if path.is_dir() {
            for image in input::images(path, "folder of photographs")? {
                look(image.display().to_string(), &input::picture(&image)?).blame("photograph", &image)?;
            }
        } else if is_picture(path) {
            look(path.display().to_string(), &input::picture(path)?).blame("photograph", path)?;
        } else {
            for (frame, picture) in Video::open(path, None)?.frames.enumerate().step_by(VIDEO_STEP) {
                look(format!("{} frame {frame}", path.display()), &picture?).blame("video", path)?;
            }
        }
    }
    let mut seen = seen.context("there is no photograph")?;
    let count = seen.views.len();
    if count > MAX_VIEWS {
        let chosen = |index: usize| (index + 1) * MAX_VIEWS / count != index * MAX_VIEWS / count;
        let views = seen.views.into_iter().zip(seen.names).enumerate();
        (seen.views, seen.names) = views.filter(|(index, _)| chosen(*index)).map(|(_, view)| view).unzip();
        println!("of {count} views {MAX_VIEWS} are used");
    }
    Ok(seen)
}

fn is_picture(path: &Path) -> bool {
    let extension = path.extension().unwrap_or_default().to_ascii_lowercase();
    ["png", "jpg", "jpeg"].iter().any(|known| extension == *known)
}

/// What to do about an error.
fn explained(error: GeometryError, detector: &Detector, seen: &Seen) -> anyhow::Error {
    let (views, photographs) = (seen.views.len(), seen.photographs);
    match error {
        GeometryError::CalibrationViews { .. } if views == 0 => anyhow!(
            "no {0} was seen in any of the {photographs} photographs: is it the right one, sharp, evenly lit, and large enough in the image?",
            detector.name()
        ),
        GeometryError::CalibrationViews { actual, expected } if actual < views => anyhow!(
            "{views} of the {photographs} photographs show the {}, but only {actual} of them as one camera sees a flat one: at least \
             {expected} are needed and 10 to 20 are good; is it flat, and the zoom the same?",
            detector.name()
        ),
        GeometryError::CalibrationViews { expected, .. } => anyhow!(
            "{views} of the {photographs} photographs show the {}, at least {expected} are needed and 10 to 20 are good",
            detector.name()
        ),
        other => other.into(),
    }
}

fn report(detector: &Detector, names: Vec<String>, found: &PlanarCalibration) -> Report {
    let residuals = || found.views.iter().flat_map(|view| &view.residuals_px);
    Report {
        target: detector.name(),
        model: format!("{:?}", found.model).to_lowercase(),
        rms_px: found.rms_px,
        points: residuals().flatten().count(),
        points_left_out: residuals().filter(|residual| residual.is_none()).count(),
        parameters: found
            .parameters
            .iter()
            .map(|p| ParameterReport {
                name: p.name,
                value: p.value,
                standard_deviation: p.deviation,
            })
            .collect(),
        views: (names.into_iter().zip(&found.views))
            .map(|(name, view)| ViewReport {
                name,
                points: view.residuals_px.iter().flatten().count(),
                rms_px: view.rms_px,
            })
            .collect(),
        deepsft_version: env!("CARGO_PKG_VERSION"),
    }
}

fn print(report: &Report, out: &Path, size: ImageSize, chosen: bool) {
    let (used, left_out): (Vec<_>, Vec<_>) = report.views.iter().partition(|view| view.rms_px.is_some());
    for view in left_out {
        println!(
            "{}: left out, its points do not agree with those of the others",
            view.name
        );
    }
    println!("{}: {size} pixels, model {}", out.display(), report.model);
    for p in &report.parameters {
        let digits = if p.name.starts_with(['k', 'p']) { 5 } else { 2 };
        println!(
            "  {:<3} {:>12.digits$} ± {:.digits$}",
            p.name, p.value, p.standard_deviation
        );
    }
    println!(
        "  RMS {:.3} px over {} points in {} views, {} left out as wrong",
        report.rms_px,
        report.points,
        used.len(),
        report.points_left_out
    );
    if chosen && report.model != "polynomial" {
        println!("  the views do not ask for more unknowns; --model polynomial solves for them all the same");
    }
    if report.rms_px > 1.0 {
        println!(
            "  that is much: is the target flat, the photographs sharp? A lens of more than 100 degrees needs --model fisheye"
        );
    }
}
