//! What the crate makes public, piece by piece.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

mod depth_range;
mod network_config;
mod r50f_config;
