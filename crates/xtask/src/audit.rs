//! `cargo xtask audit`: what is known of the packages of others that we use: holes, licences, where they come from.

use crate::tools;
use anyhow::{Context, Result};
use std::{
    ffi::OsString,
    path::{Path, PathBuf},
    process::Command,
};

/// The program that knows the advisories of RustSec, and its version where this installs it.
const CARGO_DENY: &str = "cargo-deny";
const VERSION: &str = "0.20.2";

/// What it checks apart from advisories, for which it needs the internet.
const OFFLINE_CHECKS: [&str; 3] = ["bans", "licenses", "sources"];

/// Asks cargo-deny about the crates and npm about its packages, both of them whatever the other says. `offline` leaves out what
/// asks the internet for advisories.
pub fn run(root: &Path, offline: bool) -> Result<()> {
    let mut deny = Command::new(cargo_deny(root)?);
    deny.current_dir(root).args(["--locked", "check"]);
    if offline {
        return tools::run(deny.args(OFFLINE_CHECKS));
    }
    let crates = tools::run(&mut deny);
    tools::ensure_node_packages(root)?;
    tools::run(tools::npm(root).arg("audit")).and(crates)
}

/// cargo-deny: as it is installed, or newly installed below the target folder.
fn cargo_deny(root: &Path) -> Result<PathBuf> {
    if let Some(program) = tools::on_path(CARGO_DENY) {
        return Ok(program);
    }
    let folder = tools::target_folder(root)?.join("tools");
    let program = folder
        .join("bin")
        .join(format!("{CARGO_DENY}{}", std::env::consts::EXE_SUFFIX));
    if !program.is_file() {
        let into: [OsString; 2] = ["--root".into(), folder.into()];
        let install = ["install", "--locked", "--version", VERSION, CARGO_DENY];
        tools::run(tools::cargo(root).args(install).args(into)).context("installing cargo-deny")?;
    }
    Ok(program)
}
