//! The `deepsft` command from outside: what it writes, what it says, how it exits.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

mod bad_input;
mod cameras;
mod commands;
mod common;
mod data_sets;
mod documented;
mod evaluation;
mod flat;
mod full_disk;
mod interruption;
mod kinds;
mod lookalikes;
mod meshes;
mod recordings;
mod refusals;
mod synthesis;
mod tracking;
mod videos;
