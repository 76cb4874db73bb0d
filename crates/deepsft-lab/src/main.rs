//! The `deepsft-lab` command: what measures DeepSfT and trains the network for any picture. It is not published.

#![cfg_attr(test, allow(clippy::unwrap_used, clippy::expect_used, clippy::panic))]

mod any_picture;
mod bench;
mod measuring;
mod reading;
mod study;

use anyhow::Result;
use clap::{Parser, Subcommand};

/// Measurements of DeepSfT, and the trainer of the network for any picture.
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
    /// Measure finding, tracking, rolls, cameras and rendered sheets where the truth is known.
    #[command(subcommand)]
    Study(study::StudyCommand),
}

fn main() -> Result<()> {
    match Arguments::parse().command {
        Command::AnyPicture(arguments) => any_picture::run(&arguments),
        Command::Bench(arguments) => bench::run(&arguments),
        Command::Study(command) => study::run(&command),
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
