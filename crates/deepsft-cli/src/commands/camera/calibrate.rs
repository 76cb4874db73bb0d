//! `deepsft camera calibrate`: a camera from photographs of a flat target.

use super::board::Squares;
use super::chart;
use super::target::FlatTarget;
use crate::failure::{BlameInput, usage};
use crate::input;
use crate::numbers::{SizeMm, positive};
use crate::object_choice::printed;
use crate::video::Video;
use anyhow::{Context, Result, anyhow};
use clap::Args;
use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use deepsft::encode_png;
use deepsft_calibration::{
    Calibration, CalibrationError, CameraModel, CameraParameter, CornerDetector, Correspondence, calibrate,
};
use deepsft_formats::{CameraFile, read_template};
use deepsft_geometry::{ImageSize, Picture};
use serde::Serialize;
use std::path::{Path, PathBuf};

/// Views that are solved for; more of a video say nothing new.
const MAX_VIEWS: usize = 60;

/// Side of a board's square, mm: the camera does not depend on it.
const ANY_SQUARE_MM: f64 = 30.0;

/// The calibration takes every frame of photographs, and of a video one in this many.
const VIDEO_STEP: usize = 10;

#[derive(Args)]
#[command(after_help = "\
What to photograph: 10 to 20 pictures of the flat target, tilted by 20 to 40 degrees, each time another way, near enough to
fill half of the image, and over all of them out to its corners. Focus and zoom stay as they are; no blur. All have one
size; held across or upright makes no difference. What cannot be used is named and left out.

Targets:
  --charuco 9x6              the board of deepsft camera board: may be partly hidden or cut off. For boards that others
                             print there are --dictionary, --marker and --legacy; white on black is read as well
  --checkerboard             any checkerboard, or the part of it that is seen
  --picture P --size-mm S    a print of your own picture, held flat (glass, a table); or --template DIR
Grids of circles are not read. One or two photographs tell the focal length alone, with its deviation.

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
    /// Markers of the ChArUco board, by OpenCV's name, such as 5X5_100 or APRILTAG_36h11 [default: 4X4_50]
    #[arg(long, value_name = "NAME", requires = "charuco")]
    dictionary: Option<String>,
    /// Side of its markers as a fraction of a square's [default: 0.75]
    #[arg(long, value_name = "FRACTION", requires = "charuco", value_parser = positive)]
    marker: Option<f64>,
    /// The ChArUco board is of OpenCV before 4.6: its first square may be white
    #[arg(long, requires = "charuco")]
    legacy: bool,
    /// What is unknown of the camera [default: as little as explains the views]
    #[arg(long, value_name = "MODEL", value_parser = model())]
    model: Option<CameraModel>,
    /// Camera file to write; the picture beside it has its name with .png
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
    /// Photographs (PNG, JPEG, WebP, ...), a folder of them, or a video
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
    /// Picture (PNG, JPEG, WebP, ...) whose print lies flat: give --size-mm too
    #[arg(long, value_name = "FILE", requires = "size_mm")]
    picture: Option<PathBuf>,
    /// Folder of a template whose print lies flat
    #[arg(long, value_name = "DIR")]
    template: Option<PathBuf>,
}

/// What is solved for in each of [`CameraModel::NAMED`].
const MODEL_HELP: [&str; CameraModel::NAMED.len()] = [
    "One focal length; the principal point is the centre",
    "fx, fy, cx, cy",
    "... and k1, k2",
    "... and k1, k2, p1, p2, k3",
    "fx, fy, cx, cy and the k1, k2, k3, k4 of OpenCV's fisheye",
];

/// A camera model by its name.
fn model() -> impl TypedValueParser<Value = CameraModel> {
    let named = |name: String| CameraModel::NAMED.into_iter().find(|(known, _)| *known == name);
    let described = CameraModel::NAMED.into_iter().zip(MODEL_HELP);
    PossibleValuesParser::new(described.map(|((name, _), help)| PossibleValue::new(name).help(help)))
        .try_map(move |name| named(name).map(|(_, model)| model).ok_or("no such model"))
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
    model: &'static str,
    rms_px: f64,
    points: usize,
    points_left_out: usize,
    parameters: Vec<CameraParameter>,
    views: Vec<ViewReport>,
    deepsft_version: &'static str,
}

#[derive(Serialize)]
struct ViewReport {
    name: String,
    points: usize,
    /// Null for a view that was left out.
    rms_px: Option<f64>,
}

pub fn run(arguments: &CalibrateArguments) -> Result<()> {
    let mut target = target(arguments)?;
    let seen = views(&mut target, &arguments.inputs)?;
    let found = calibrate(&seen.views, seen.size, arguments.model)
        .map_err(|error| explained(error, &target, &seen))
        .blame("photographs", &arguments.inputs[0])?;
    let picture = chart::chart(seen.size, &seen.views, &found);
    let file = CalibratedFile {
        camera: CameraFile::new(&found.camera),
        calibration: report(&target, seen.names, found),
    };
    print(&file.calibration, &arguments.out, seen.size, arguments.model.is_none());
    deepsft_formats::write_file(&arguments.out.with_extension("png"), &encode_png(&picture)?)?;
    deepsft_formats::write_file(&arguments.out, &serde_json::to_vec_pretty(&file)?)?;
    Ok(())
}

fn target(arguments: &CalibrateArguments) -> Result<FlatTarget> {
    if arguments.out.extension().is_some_and(|extension| extension == "png") {
        return Err(usage(
            "--out is the camera file (camera.json); the picture is written beside it",
        ));
    }
    let target = &arguments.target;
    if let Some(squares) = target.charuco {
        let board = squares.board(ANY_SQUARE_MM)?;
        let board = match (arguments.dictionary.as_deref(), arguments.marker) {
            (None, None) => Ok(board),
            (dictionary, marker) => board.with_markers(dictionary.unwrap_or("4X4_50"), marker.unwrap_or(0.75)),
        };
        let board = board.and_then(|board| match arguments.legacy {
            true => board.with_legacy_pattern(),
            false => Ok(board),
        });
        let detector = board.and_then(|board| CornerDetector::charuco(&board));
        return Ok(FlatTarget::board(detector.map_err(|error| usage(error.to_string()))?));
    }
    if target.checkerboard {
        return Ok(FlatTarget::board(CornerDetector::checkerboard()?));
    }
    if let (Some(file), Some(size)) = (&target.picture, arguments.size_mm) {
        return FlatTarget::print(printed(file, size, None)?).blame("picture", file);
    }
    let folder = target.template.as_ref().context("a target is needed")?;
    let template = read_template(folder)?;
    if !template.is_sheet() {
        return Err(anyhow!(
            "it is no flat sheet, and a camera needs one: take a board or a flat print"
        ))
        .blame("template", folder);
    }
    FlatTarget::print(template).blame("template", folder)
}

/// What was seen of the target.
struct Seen {
    /// Columns and rows of all photographs.
    size: ImageSize,
    views: Vec<Vec<Correspondence>>,
    /// Their files, or the numbers of their frames.
    names: Vec<String>,
    /// All photographs that were looked at.
    photographs: Vec<String>,
}

fn views(target: &mut FlatTarget, inputs: &[PathBuf]) -> Result<Seen> {
    // By the size of the photographs: one camera at one zoom has one.
    let mut by_size: Vec<Seen> = Vec::new();
    let mut look = |name: String, picture: &Picture| -> Result<()> {
        let size = picture.size();
        let known = by_size.iter().position(|seen| seen.size == size);
        let place = known.unwrap_or_else(|| {
            by_size.push(Seen {
                size,
                views: Vec::new(),
                names: Vec::new(),
                photographs: Vec::new(),
            });
            by_size.len() - 1
        });
        let seen = &mut by_size[place];
        seen.photographs.push(name.clone());
        match (target.detect)(picture)? {
            Some(view) => {
                println!("{name}: {} points", view.len());
                seen.views.push(view);
                seen.names.push(name);
            }
            None => println!("{name}: no {}", target.name),
        }
        Ok(())
    };
    for path in inputs {
        if path.is_dir() {
            for image in input::pictures_in(path, "folder of photographs")? {
                photograph(&image, &mut look);
            }
        } else if input::is_picture(path) {
            photograph(path, &mut look);
        } else {
            for (frame, picture) in Video::open(path, None, false)?.frames.enumerate() {
                let picture = match picture {
                    Ok(frame) => frame.picture,
                    Err(error) => {
                        eprintln!(
                            "warning: of the video {} the first {frame} frames are used: {error:#}",
                            path.display()
                        );
                        break;
                    }
                };
                if frame.is_multiple_of(VIDEO_STEP) {
                    look(format!("{} frame {frame}", path.display()), &picture).blame("video", path)?;
                }
            }
        }
    }
    // Of as many the first.
    let most = (0..by_size.len()).rev().max_by_key(|&k| by_size[k].photographs.len());
    let mut seen = by_size.swap_remove(
        most.context("there is no photograph that can be used: the warnings say why")
            .blame("photographs", &inputs[0])?,
    );
    for Seen { size, photographs, .. } in by_size {
        let names = photographs.join(", ");
        eprintln!(
            "warning: left out: {names}: {size} pixels, most photographs have {}",
            seen.size
        );
    }
    let count = seen.views.len();
    if count > MAX_VIEWS {
        let chosen = |index: usize| (index + 1) * MAX_VIEWS / count != index * MAX_VIEWS / count;
        let views = seen.views.into_iter().zip(seen.names).enumerate();
        (seen.views, seen.names) = views.filter(|(index, _)| chosen(*index)).map(|(_, view)| view).unzip();
        println!("of {count} views {MAX_VIEWS} are used");
    }
    Ok(seen)
}

/// Looks at a photograph. One that cannot be used is named and left out.
fn photograph(path: &Path, look: &mut impl FnMut(String, &Picture) -> Result<()>) {
    let seen = input::photograph_as_stored(path)
        .and_then(|picture| look(path.display().to_string(), &picture).blame("photograph", path));
    if let Err(error) = seen {
        eprintln!("warning: left out: {error:#}");
    }
}

/// What to do about an error.
fn explained(error: CalibrationError, target: &FlatTarget, seen: &Seen) -> anyhow::Error {
    let (views, photographs, name) = (seen.views.len(), seen.photographs.len(), target.name);
    match error {
        CalibrationError::Views { .. } if views == 0 => anyhow!(
            "no {name} was seen in any of the {photographs} photographs: is it the right one (of other ArUco markers see --dictionary, --marker and \
             --legacy; grids of circles are not read), sharp, evenly lit, and large enough in the image?"
        ),
        CalibrationError::Views { actual, expected } if actual < views => anyhow!(
            "{views} of the {photographs} photographs show the {name}, but only {actual} of them as one camera sees a flat one: at least \
             {expected} are needed and 10 to 20 are good; is it flat, and the zoom the same?"
        ),
        CalibrationError::Views { expected, .. } => anyhow!(
            "{views} of the {photographs} photographs show the {name}, at least {expected} are needed and 10 to 20 are good"
        ),
        other => other.into(),
    }
}

fn report(target: &FlatTarget, names: Vec<String>, found: Calibration) -> Report {
    let residuals = || found.views.iter().flat_map(|view| &view.residuals_px);
    Report {
        target: target.name,
        model: found.model.name(),
        rms_px: found.rms_px,
        points: residuals().flatten().count(),
        points_left_out: residuals().filter(|residual| residual.is_none()).count(),
        views: (names.into_iter().zip(&found.views))
            .map(|(name, view)| ViewReport {
                name,
                points: view.residuals_px.iter().flatten().count(),
                rms_px: view.rms_px,
            })
            .collect(),
        parameters: found.parameters,
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
    let (used, points, left_out) = (used.len(), report.points, report.points_left_out);
    let rms_px = report.rms_px;
    println!("  RMS {rms_px:.3} px over {points} points in {used} views, {left_out} left out as wrong");
    if chosen && used >= 3 && report.model != "polynomial" {
        println!("  the views do not ask for more unknowns; --model polynomial solves for them all the same");
    }
    if used < 3 {
        println!(
            "  so few views tell the focal length alone: take 10 to 20, each tilted another way, for the rest of the camera"
        );
    }
    if rms_px > 1.0 {
        println!(
            "  that is much: is the target flat, the photographs sharp? A lens of more than 100 degrees needs --model fisheye"
        );
    }
}
