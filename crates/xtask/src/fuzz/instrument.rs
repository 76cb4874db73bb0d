//! Our own crates as a fuzzer needs them. Cargo calls this program in place of rustc for the crates of the workspace, and
//! all others stay as the ordinary build has left them.

use anyhow::{Context, Result};
use std::{
    env,
    path::Path,
    process::{Command, ExitCode},
};

/// The environment variable by which such a call is known.
const VARIABLE: &str = "DEEPSFT_INSTRUMENT";

/// Coverage for libFuzzer, as `cargo fuzz --sanitizer none` asks for it, and every check of arithmetic and assertions.
const FLAGS: [&str; 7] = [
    "passes=sancov-module",
    "llvm-args=-sanitizer-coverage-level=4",
    "llvm-args=-sanitizer-coverage-inline-8bit-counters",
    "llvm-args=-sanitizer-coverage-pc-table",
    "llvm-args=-sanitizer-coverage-trace-compares",
    "debug-assertions=on",
    "overflow-checks=on",
];

/// Has a cargo command compile the crates of the workspace for a fuzzer.
pub fn instrument(cargo: &mut Command) -> Result<()> {
    let program = env::current_exe().context("finding this program")?;
    cargo.env("RUSTC_WORKSPACE_WRAPPER", program).env(VARIABLE, "1");
    Ok(())
}

/// The rustc that cargo wants this program to call, with its arguments.
pub fn called_as_rustc(arguments: &[String]) -> Option<(&str, &[String])> {
    let (rustc, rest) = arguments.split_first()?;
    let is_rustc = Path::new(rustc).file_stem().is_some_and(|name| name == "rustc");
    (is_rustc && env::var_os(VARIABLE).is_some()).then_some((rustc, rest))
}

/// Calls rustc.
///
/// # Errors
/// When it does not start.
pub fn rustc(rustc: &str, arguments: &[String]) -> Result<ExitCode> {
    let mut command = Command::new(rustc);
    command.args(arguments);
    if is_of_the_program(arguments) {
        FLAGS.iter().for_each(|flag| {
            command.args(["-C", flag]);
        });
    }
    let status = command.status().with_context(|| format!("starting {rustc}"))?;
    Ok(ExitCode::from(status.code().map_or(1, |code| code as u8)))
}

/// Whether what is compiled becomes part of the program: no question to rustc, and nothing that runs within it or cargo.
fn is_of_the_program(arguments: &[String]) -> bool {
    let after = |option: &str| {
        let at = arguments.iter().position(|argument| argument == option)?;
        arguments.get(at + 1).map(String::as_str)
    };
    let name = after("--crate-name").unwrap_or("___");
    name != "___" && name != "build_script_build" && after("--crate-type") != Some("proc-macro")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_what_becomes_part_of_the_program_is_instrumented() {
        let words = |line: &str| -> Vec<String> { line.split_whitespace().map(str::to_owned).collect() };
        for (line, expected) in [
            ("--crate-name deepsft src/lib.rs --crate-type lib", true),
            ("-vV", false),
            ("- --crate-name ___ --print=file-names", false),
            ("--crate-name build_script_build build.rs --crate-type bin", false),
            ("--crate-name derive src/lib.rs --crate-type proc-macro", false),
        ] {
            assert_eq!(is_of_the_program(&words(line)), expected, "{line}");
        }
    }

    #[test]
    fn a_task_is_no_call_of_rustc() {
        assert_eq!(called_as_rustc(&["fuzz".to_owned()]), None);
        assert_eq!(
            called_as_rustc(&["/usr/bin/rustc".to_owned(), "-vV".to_owned()]),
            None,
            "the variable is not set"
        );
    }
}
