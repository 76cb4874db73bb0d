//! The `deepsft-lab` command: what measures DeepSfT and makes its own material. It is not published.

#![cfg_attr(test, allow(clippy::unwrap_used, clippy::expect_used, clippy::panic))]

// First: its macros are for all that follow.
#[macro_use]
extern crate deepsft_cli;

mod any_picture;
mod bench;
mod completion;
mod interruptions;
mod material;
mod measuring;
mod network_time;
mod poster;
mod soak;
mod study;
mod toy;

use clap::{Parser, Subcommand};
use deepsft_cli::failure;
use std::process::ExitCode;

/// Measurements of DeepSfT, and the makers of its own templates.
#[derive(Parser)]
#[command(version, propagate_version = true)]
struct Arguments {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    /// Train the network that describes any picture.
    AnyPicture(any_picture::AnyPictureArguments),
    /// Measure how fast this machine synthesises, trains and estimates.
    Bench(bench::BenchArguments),
    /// Measure ARAP completion: how well it recovers hidden parts, and how fast.
    #[command(subcommand)]
    Completion(completion::CompletionCommand),
    /// The commands of `deepsft`, for `kills` and `full-disk`.
    #[command(subcommand, hide = true)]
    Deepsft(Box<deepsft_cli::Command>),
    /// Let a command of `deepsft` write to a disk that becomes full, and compare what it leaves with an uninterrupted run.
    FullDisk(interruptions::FullDiskArguments),
    /// Kill a command of `deepsft` at random moments, and compare what it ends with with an uninterrupted run.
    Kills(interruptions::KillsArguments),
    /// Measure the time and the memory of a network's forward pass.
    NetworkTime(network_time::NetworkTimeArguments),
    /// Write the A4 poster: a template ready to train for, and a PDF to print.
    Poster(material::PosterArguments),
    /// Track a video without an end, and fail when memory grows.
    Soak(soak::SoakArguments),
    /// Measure fitting and tracking, and how errors grow with what makes a frame hard.
    #[command(subcommand)]
    Study(study::StudyCommand),
    /// Write the soft toy, a template of an object with a volume.
    ///
    /// A patchwork rabbit about 300 mm high, made by a program: a closed surface with 18 pieces of texture.
    Toy(material::ToyArguments),
}

fn main() -> ExitCode {
    let result = match Arguments::parse().command {
        Command::AnyPicture(arguments) => any_picture::run(&arguments),
        Command::Bench(arguments) => bench::run(&arguments),
        Command::Completion(command) => completion::run(&command),
        Command::Deepsft(command) => return deepsft_cli::execute(&command),
        Command::FullDisk(arguments) => interruptions::run_full_disk(&arguments),
        Command::Kills(arguments) => interruptions::run_kills(&arguments),
        Command::NetworkTime(arguments) => network_time::run(&arguments),
        Command::Poster(arguments) => material::write_poster(&arguments),
        Command::Soak(arguments) => soak::run(&arguments),
        Command::Study(command) => study::run(&command),
        Command::Toy(arguments) => material::write_toy(&arguments),
    };
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => failure::report(&error),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory;

    #[test]
    fn the_command_line_is_consistent() {
        Arguments::command().debug_assert();
    }
}
