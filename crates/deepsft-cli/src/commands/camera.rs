//! `deepsft camera`: boards to print, and the camera that photographs of them were taken by.

mod board;
mod calibrate;
mod chart;
mod target;

use anyhow::Result;
use clap::Subcommand;

#[derive(Subcommand)]
pub enum CameraCommand {
    /// Write a ChArUco board to print, as PDF or PNG.
    Board(board::BoardArguments),
    /// Calibrate a camera from photographs or a video of a board or of a flat print.
    Calibrate(calibrate::CalibrateArguments),
}

pub fn run(command: &CameraCommand) -> Result<()> {
    match command {
        CameraCommand::Board(arguments) => board::run(arguments),
        CameraCommand::Calibrate(arguments) => calibrate::run(arguments),
    }
}
