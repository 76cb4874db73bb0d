//! The `deepsft` command: from a picture of a flat object, or a scan of any, to a trained model and to reconstructions.
//!
//! The library is there for the program, and for those who read its videos: it has no other interface.

#![cfg_attr(test, allow(clippy::unwrap_used, clippy::expect_used, clippy::panic))]

// First: its macros are for all that follow.
#[macro_use]
mod printing;

mod camera_choice;
mod commands;
mod failure;
mod ffmpeg;
mod heif;
mod input;
mod interruption;
mod mesh_choice;
mod network_choice;
mod numbers;
mod object_choice;
mod output;
mod progress;
mod synthesis;
mod video;

use clap::{Parser, Subcommand};
use std::process::ExitCode;
pub use video::Yuv4Mpeg;

/// Shape and registration of a known bending object from one image (Shape-from-Template).
///
/// A template is a picture of a flat object and its size, or a scan with its texture. You train a network for it on synthetic
/// images. The network then finds the object in photographs: the depth of every pixel, and its place on the template.
#[derive(Parser)]
#[command(version, propagate_version = true, after_help = AFTER_HELP)]
struct Arguments {
    #[command(subcommand)]
    command: Command,
}

const AFTER_HELP: &str = "\
The way from a picture to a reconstruction:
  deepsft template new --image cover.jpg --size-mm 297x210 --out cover     (or: template import scan.glb)
  deepsft train --template cover --out cover-model --minutes 60
  deepsft eval --model cover-model --synthetic 100 --seed 999
  deepsft reconstruct --model cover-model --camera camera.json --out results photo.jpg
  deepsft track --model cover-model --camera camera.json --pictures --out track video.mp4

Exit codes:
  0  done
  1  failed: a file could not be written, another folder or checkpoint is in the way, a device failed, a training diverged, ffmpeg
     is not there
  2  the command line is wrong
  3  an input is missing, corrupt or unfit: image, camera file, scan, template, model bundle, data set, recording, checkpoint,
     video
  130  interrupted by Ctrl-C: track keeps the frames until then
  141  the reader of the output went away before its end, as head does";

/// What the program can do.
#[derive(Subcommand)]
enum Command {
    /// Make a template.
    #[command(subcommand)]
    Template(commands::template::TemplateCommand),
    /// Write a synthetic data set of a template: images with exact depth and registration.
    Synth(commands::synth::SynthArguments),
    /// Train a network for a template: on synthetic images made on the fly or on disk, then on an RGB-D recording.
    Train(commands::train::TrainArguments),
    /// Calibrate a camera: boards to print, and photographs of them.
    #[command(subcommand)]
    Camera(commands::camera::CameraCommand),
    /// Simulate, import and check RGB-D recordings, which training steps 2 and 3 learn from.
    #[command(subcommand)]
    Recording(commands::recording::RecordingCommand),
    /// Measure a model against ground truth.
    Eval(commands::eval::EvalArguments),
    /// Find the template in photographs: depth, registration, mask and mesh.
    Reconstruct(commands::reconstruct::ReconstructArguments),
    /// Follow the template through a video: the mesh in every frame.
    Track(commands::track::TrackArguments),
    /// Write a synthetic clip of a moving sheet, with ground truth.
    Clip(commands::clip::ClipArguments),
    /// Print what a network is made of.
    #[command(subcommand)]
    Network(commands::network::NetworkCommand),
    /// Look after model bundles.
    #[command(subcommand)]
    Bundle(commands::bundle::BundleCommand),
}

/// Runs the command that the process's arguments ask for.
pub fn run() -> ExitCode {
    let result = match &Arguments::parse().command {
        Command::Template(command) => commands::template::run(command),
        Command::Synth(arguments) => commands::synth::run(arguments),
        Command::Train(arguments) => commands::train::run(arguments),
        Command::Camera(command) => commands::camera::run(command),
        Command::Recording(command) => commands::recording::run(command),
        Command::Eval(arguments) => commands::eval::run(arguments),
        Command::Reconstruct(arguments) => commands::reconstruct::run(arguments),
        Command::Track(arguments) => commands::track::run(arguments),
        Command::Clip(arguments) => commands::clip::run(arguments),
        Command::Network(command) => commands::network::run(command),
        Command::Bundle(command) => commands::bundle::run(command),
    };
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => failure::report(&error),
    }
}

#[cfg(test)]
#[path = "../tests/unit/mod.rs"]
mod unit;

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory;

    #[test]
    fn the_command_line_is_consistent() {
        Arguments::command().debug_assert();
    }
}
