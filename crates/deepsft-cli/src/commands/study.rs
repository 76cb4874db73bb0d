//! `deepsft study`: what a part of the pipeline is worth, measured where the truth is known.

mod physics;
mod tracking;

use anyhow::Result;
use clap::Subcommand;

#[derive(Subcommand)]
pub enum StudyCommand {
    /// Physics refinement against the maps it starts from, one disturbance at a time.
    Physics(physics::PhysicsStudyArguments),
    /// Tracking on synthetic clips: share of frames tracked, recoveries, jitter, lag, time.
    Tracking(tracking::TrackingStudyArguments),
}

pub fn run(command: &StudyCommand) -> Result<()> {
    match command {
        StudyCommand::Physics(arguments) => physics::run(arguments),
        StudyCommand::Tracking(arguments) => tracking::run(arguments),
    }
}
