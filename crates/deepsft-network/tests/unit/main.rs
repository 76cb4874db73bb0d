//! What the crate makes public, piece by piece.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

mod descriptors;
mod device;
mod layer_table;
