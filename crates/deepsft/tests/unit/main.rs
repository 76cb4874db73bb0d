//! What the crate makes public, piece by piece.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

mod bundle;
mod depth_range;
mod device;
mod finding;
mod layer_table;
mod network_config;
mod photo_consistency;
mod r50f_config;
mod seams;
