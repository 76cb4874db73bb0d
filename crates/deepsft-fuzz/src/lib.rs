//! Fuzz targets: every reader of files from elsewhere, fed with any bytes.
//!
//! A reader gives a value or an error in words. A panic, more than 1 GB of memory or 30 s for one input are bugs.
//! `cargo xtask fuzz` runs the targets under libFuzzer, whose mutations are guided by the code that they reach.

#![cfg_attr(test, allow(clippy::unwrap_used, clippy::panic))]
// A broken promise ends the program: that is what the fuzzer sees.
#![allow(clippy::expect_used)]

mod bundle;
mod camera;
mod files;
mod gltf;
mod obj;
mod picture;
mod planted;
mod ply;
mod png;
mod recording;
mod shard;
mod template;
mod weights;
mod y4m;

use anyhow::Result;

/// A reader that is fuzzed.
#[derive(Clone, Copy, Debug)]
pub struct Target {
    /// Its name.
    pub name: &'static str,
    /// Reads an input and uses what comes of it. An error is the reader's refusal; it panics when what was read breaks a
    /// promise of the reader.
    pub read: fn(&[u8]) -> Result<()>,
    /// Inputs from which mutations begin: files that are read, and some that are refused.
    pub seeds: fn() -> Result<Vec<Vec<u8>>>,
}

macro_rules! targets {
    ($($module:ident),*) => {
        [$(Target { name: stringify!($module), read: $module::read, seeds: $module::seeds }),*]
    };
}

/// The targets, by name.
pub const TARGETS: [Target; 11] = targets![
    bundle, camera, gltf, obj, picture, ply, recording, shard, template, weights, y4m
];

/// Targets that fail on inputs which only guided mutation finds, so that we know that a failure is seen.
const PLANTED: [Target; 2] = [
    Target {
        name: "planted-panic",
        read: planted::panics,
        seeds: planted::seeds,
    },
    Target {
        name: "planted-memory",
        read: planted::takes_memory,
        seeds: planted::seeds,
    },
];

impl Target {
    /// The target of this name.
    pub fn named(name: &str) -> Option<&'static Self> {
        TARGETS.iter().chain(&PLANTED).find(|target| target.name == name)
    }
}
