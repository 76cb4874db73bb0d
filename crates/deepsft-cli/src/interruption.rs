//! Ctrl-C and the request to end (SIGTERM): a command that watches for them ends in order.

use anyhow::{Context, Result};
use std::sync::atomic::{AtomicBool, Ordering};

/// Whether the user asked the command to end.
static ASKED: AtomicBool = AtomicBool::new(false);

/// What a shell expects of a command that ended by Ctrl-C.
pub const EXIT_CODE: u8 = 130;

/// The user asked the command to end.
#[derive(Debug, thiserror::Error)]
#[error("interrupted")]
pub struct Interrupted;

/// From now on Ctrl-C only asks, see [`check`]; the second one ends the process at once.
pub fn watch() -> Result<()> {
    ctrlc::set_handler(|| {
        if ASKED.swap(true, Ordering::Relaxed) {
            std::process::exit(EXIT_CODE.into());
        }
    })
    .context("could not watch for Ctrl-C")
}

/// An error once the user has asked the command to end.
pub fn check() -> Result<()> {
    if ASKED.load(Ordering::Relaxed) {
        return Err(Interrupted.into());
    }
    Ok(())
}
