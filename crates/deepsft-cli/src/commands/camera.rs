//! `deepsft camera`: boards to print, the camera that photographs of them were taken by, and cameras of other programs.

mod board;
mod calibrate;
mod chart;
mod import;
mod target;

use anyhow::Result;
use clap::Subcommand;

#[derive(Subcommand)]
pub enum CameraCommand {
    /// Write a ChArUco board to print, as PDF or PNG.
    Board(board::BoardArguments),
    /// Calibrate a camera from photographs or a video of a board or of a flat print.
    Calibrate(calibrate::CalibrateArguments),
    /// Read the camera file of another program: OpenCV, ROS, Kalibr, COLMAP, RealSense, ARKit.
    Import(import::ImportArguments),
}

pub fn run(command: &CameraCommand) -> Result<()> {
    match command {
        CameraCommand::Board(arguments) => board::run(arguments),
        CameraCommand::Calibrate(arguments) => calibrate::run(arguments),
        CameraCommand::Import(arguments) => import::run(arguments),
    }
}
