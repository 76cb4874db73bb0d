//! `deepsft-lab completion`: how well hidden parts are recovered, and how fast.

mod accuracy;
mod benchmark_shape;
mod interpolation;
mod partial_view;
mod picture;
mod rod_bend;
mod speed;
mod subject;

use anyhow::Result;
use clap::Subcommand;

#[derive(Subcommand)]
pub enum CompletionCommand {
    /// Measure how well ARAP completion recovers what is hidden.
    Accuracy(accuracy::AccuracyArguments),
    /// Measure how fast ARAP completion is, on meshes of 1,500 to 40,000 faces.
    Speed(speed::SpeedArguments),
}

pub fn run(command: &CompletionCommand) -> Result<()> {
    match command {
        CompletionCommand::Accuracy(arguments) => accuracy::run(arguments),
        CompletionCommand::Speed(arguments) => speed::run(arguments),
    }
}
