//! The `deepsft-baselines` command: the classical methods of the paper's tables, measured beside ours on the same frames. It is not published.

#![cfg_attr(test, allow(clippy::unwrap_used, clippy::expect_used, clippy::panic))]

mod ch17;
mod ch17r;
mod compare;
mod dof;
mod figure;
mod flow;
mod frame;
mod methods;
mod ngo15;
mod ours;
mod reduced;
mod spline;
mod stopwatch;
mod table;

use anyhow::Result;
use clap::{Parser, Subcommand};

/// The classical methods of the DeepSfT paper's tables beside ours.
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
}

fn main() -> Result<()> {
    match Arguments::parse().command {
        Command::Compare(arguments) => compare::run(&arguments),
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
