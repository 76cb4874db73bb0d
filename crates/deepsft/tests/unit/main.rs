//! What the crate makes public, piece by piece.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

#[path = "../../../deepsft-geometry/tests/common/printed_box.rs"]
mod printed_box;

mod bundle;
mod device;
mod finding;
mod lookalikes;
mod near;
mod session;
