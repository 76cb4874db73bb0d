//! `deepsft study`: what a part of the pipeline is worth, measured where the truth is known.

mod tracking;

use anyhow::Result;
use clap::Subcommand;

#[derive(Subcommand)]
pub enum StudyCommand {
    /// Tracking on synthetic clips: share of frames tracked, recoveries, jitter, lag, time.
    Tracking(tracking::TrackingStudyArguments),
}

pub fn run(command: &StudyCommand) -> Result<()> {
    match command {
        StudyCommand::Tracking(arguments) => tracking::run(arguments),
    }
}
