//! The `deepsft` command.

use std::process::ExitCode;

fn main() -> ExitCode {
    deepsft_cli::run()
}
