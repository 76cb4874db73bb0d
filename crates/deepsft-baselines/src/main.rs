//! The `deepsft-baselines` command: the methods of the paper's tables, classical and networks, measured beside ours on the same frames. It is not published.

#![cfg_attr(test, allow(clippy::unwrap_used, clippy::expect_used, clippy::panic))]

mod benchmark;
mod ch17;
mod ch17r;
mod compare;
mod dof;
mod figure;
mod flow;
mod frame;
mod frames;
mod maps_file;
mod methods;
mod networks;
mod ngo15;
mod ours;
mod paper;
mod reduced;
mod robusft;
mod spline;
mod stopwatch;
mod table;
mod tables;
mod train;

use anyhow::Result;
use clap::{Parser, Subcommand};

/// The methods of the DeepSfT paper's tables beside ours.
#[derive(Parser)]
#[command(version, propagate_version = true)]
struct Arguments {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    /// Run methods on the same synthetic frames and print the paper's table.
    Compare(compare::CompareArguments),
    /// Make frames for everybody's method, and score predictions on them.
    #[command(subcommand)]
    Benchmark(benchmark::BenchmarkCommand),
    /// Print the tables of the paper with our rows in them.
    Tables(tables::TablesArguments),
    /// Train a network of others on our synthetic samples.
    Train(train::TrainArguments),
}

fn main() -> Result<()> {
    match Arguments::parse().command {
        Command::Compare(arguments) => compare::run(&arguments),
        Command::Tables(arguments) => tables::run(&arguments),
        Command::Benchmark(command) => benchmark::run(&command),
        Command::Train(arguments) => train::run(&arguments),
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
