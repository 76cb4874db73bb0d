//! Fuzz targets: every reader of files from elsewhere, fed with any bytes.
//!
//! A reader gives a value or an error in words. A panic, more than 1 GB of memory or 10 s for one input are bugs.
//! `cargo xtask fuzz` runs the targets under libFuzzer, whose mutations are guided by the code that they reach.

#![cfg_attr(test, allow(clippy::unwrap_used, clippy::panic))]
// A broken promise ends the program: that is what the fuzzer sees.
#![allow(clippy::expect_used)]

mod files;
mod parts;
mod png;
mod targets;

use anyhow::Result;
use targets::{bundle, checkpoint, gltf, obj, picture, planted, recording, shard, template, weights, y4m};

/// A reader that is fuzzed.
#[derive(Clone, Copy, Debug)]
pub struct Target {
    /// Its name.
    pub name: &'static str,
    /// Longest input, bytes.
    pub longest: usize,
    /// Reads an input and uses what comes of it. An error is the reader's refusal; it panics when what was read breaks a
    /// promise of the reader.
    pub read: fn(&[u8]) -> Result<()>,
    /// Inputs that are read without an error, from which mutations begin.
    pub seeds: fn() -> Result<Vec<Vec<u8>>>,
}

/// The targets, by name.
pub const TARGETS: [Target; 10] = [
    Target {
        name: "bundle",
        longest: 4096,
        read: bundle::read,
        seeds: bundle::seeds,
    },
    Target {
        name: "checkpoint",
        longest: 4096,
        read: checkpoint::read,
        seeds: checkpoint::seeds,
    },
    Target {
        name: "gltf",
        longest: 4096,
        read: gltf::read,
        seeds: gltf::seeds,
    },
    Target {
        name: "obj",
        longest: 2048,
        read: obj::read,
        seeds: obj::seeds,
    },
    Target {
        name: "picture",
        longest: 2048,
        read: picture::read,
        seeds: picture::seeds,
    },
    Target {
        name: "recording",
        longest: 2048,
        read: recording::read,
        seeds: recording::seeds,
    },
    Target {
        name: "shard",
        longest: 8192,
        read: shard::read,
        seeds: shard::seeds,
    },
    Target {
        name: "template",
        longest: 2048,
        read: template::read,
        seeds: template::seeds,
    },
    Target {
        name: "weights",
        longest: 4096,
        read: weights::read,
        seeds: weights::seeds,
    },
    Target {
        name: "y4m",
        longest: 1024,
        read: y4m::read,
        seeds: y4m::seeds,
    },
];

/// Targets that fail on inputs which only guided mutation finds, so that we know that a failure is seen.
const PLANTED: [Target; 2] = [
    Target {
        name: "planted-panic",
        longest: 64,
        read: planted::panics,
        seeds: planted::seeds,
    },
    Target {
        name: "planted-memory",
        longest: 64,
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
