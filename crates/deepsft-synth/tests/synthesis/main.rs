//! Whole samples, clips, recordings and shards, as a program that uses the crate makes them.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

mod clips;
mod closed_forms;
mod imports;
mod meshes;
mod recordings;
mod samples;
mod shards;
