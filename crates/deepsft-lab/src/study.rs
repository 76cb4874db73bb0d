//! `deepsft-lab study`: what a part of the pipeline is worth, measured where the truth is known.

mod calibration;
mod cameras;
mod finding;
mod fit;
mod precision;
mod rolls;
mod shapes;
mod tracking;

use anyhow::Result;
use clap::Subcommand;

#[derive(Subcommand)]
pub enum StudyCommand {
    /// Measure how exactly the focal length is found from a sheet that bends, in clips.
    Calibration(calibration::CalibrationStudyArguments),
    /// Measure the same scenes through several cameras, with and without the canonical warp.
    Cameras(cameras::CamerasArguments),
    /// Measure how often features find a print that nothing was trained for.
    Finding(finding::FindingStudyArguments),
    /// Compare the fitted mesh with the maps that the fit starts from, one disturbance at a time.
    Fit(fit::FitStudyArguments),
    /// Evaluate a model with its weights rounded to fewer bits.
    Precision(precision::PrecisionArguments),
    /// Measure how often an object is found by how it is rolled, before a camera that lies across and one that stands upright.
    Rolls(rolls::RollsArguments),
    /// Train compact networks of other sides on the same samples: accuracy, operations, time.
    Shapes(shapes::ShapesArguments),
    /// Measure tracking on synthetic clips: fraction of frames tracked, recoveries, jitter, lag, time.
    Tracking(tracking::TrackingStudyArguments),
}

pub fn run(command: &StudyCommand) -> Result<()> {
    match command {
        StudyCommand::Calibration(arguments) => calibration::run(arguments),
        StudyCommand::Cameras(arguments) => cameras::run(arguments),
        StudyCommand::Finding(arguments) => finding::run(arguments),
        StudyCommand::Fit(arguments) => fit::run(arguments),
        StudyCommand::Precision(arguments) => precision::run(arguments),
        StudyCommand::Rolls(arguments) => rolls::run(arguments),
        StudyCommand::Shapes(arguments) => shapes::run(arguments),
        StudyCommand::Tracking(arguments) => tracking::run(arguments),
    }
}
