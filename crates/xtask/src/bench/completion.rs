//! ARAP completion beside libigl: its Python package takes turns with ours, frame by frame.

use super::{Options, build_program, program, rivals};
use crate::tools;
use anyhow::{Context, Result};
use std::path::Path;

/// The pinned versions of Python's packages.
pub const REQUIREMENTS: &str = "requirements-completion.txt";

/// Installs libigl below `folder`, measures, and writes the figures as JSON.
///
/// # Errors
/// When something cannot be built, installed or measured.
pub fn run(root: &Path, target_folder: &Path, folder: &Path, options: &Options) -> Result<()> {
    if options.build {
        build_program(root)?;
    }
    let file = match &options.json {
        Some(file) => root.join(file),
        None => folder.join("completion.json"),
    };
    let mut command = program(target_folder);
    command
        .args(["completion", "speed", "--runs", &options.runs.to_string(), "--json"])
        .arg(&file);
    if options.rivals {
        let scripts = rivals::scripts(root);
        let python = rivals::install_python(&scripts, REQUIREMENTS, &folder.join("python-completion"));
        let python = python.context("libigl cannot be installed; --no-libigl measures without it")?;
        command
            .args(["--rival", "libigl", "--"])
            .arg(python)
            .arg("-B")
            .arg(scripts.join("libigl_turns.py"));
    }
    tools::run(&mut command)?;
    println!("\nall figures: {}", file.display());
    Ok(())
}
