//! Cameras, and the way from any of them to the canonical image.

mod canonical;
mod pinhole;

pub use canonical::{CANONICAL_HEIGHT, CANONICAL_WIDTH, CanonicalWarp, canonical_camera, training_camera};
pub use pinhole::{Camera, PAPER_CAMERAS};
