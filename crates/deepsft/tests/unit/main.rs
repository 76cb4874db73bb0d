//! What the crate makes public, piece by piece.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

mod bundle;
mod device;
mod finding;
mod near;
mod session;
