//! `deepsft-lab study`: gauges of what a part of the pipeline is worth, where the truth is known.

mod blender;
mod cameras;
mod cards;
mod finding;
mod frames;
mod rolls;
mod solids;
mod tracking;

use anyhow::Result;
use clap::Subcommand;

#[derive(Subcommand)]
pub enum StudyCommand {
    /// Measure the fit on frames of another renderer, with materials, lights and shapes of their own.
    Blender(blender::BlenderArguments),
    /// Measure the same scenes through several cameras, with and without the canonical warp.
    Cameras(cameras::CamerasArguments),
    /// Measure whether the right one of cards that resemble each other is named.
    Cards(cards::CardsArguments),
    /// Measure how often features find a print that nothing was trained for.
    Finding(finding::FindingStudyArguments),
    /// Measure how often an object is found by how it is rolled, before a camera that lies across and one that stands upright.
    Rolls(rolls::RollsArguments),
    /// Measure how often objects with a volume are found without training, and how exact the fit is.
    Solids(solids::SolidsArguments),
    /// Measure tracking on synthetic clips: fraction of frames tracked, recoveries, jitter, lag, time.
    Tracking(tracking::TrackingStudyArguments),
}

pub fn run(command: &StudyCommand) -> Result<()> {
    match command {
        StudyCommand::Blender(arguments) => blender::run(arguments),
        StudyCommand::Cameras(arguments) => cameras::run(arguments),
        StudyCommand::Cards(arguments) => cards::run(arguments),
        StudyCommand::Finding(arguments) => finding::run(arguments),
        StudyCommand::Rolls(arguments) => rolls::run(arguments),
        StudyCommand::Solids(arguments) => solids::run(arguments),
        StudyCommand::Tracking(arguments) => tracking::run(arguments),
    }
}
