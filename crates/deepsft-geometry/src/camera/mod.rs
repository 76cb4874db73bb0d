//! Cameras, and the way from any of them to the canonical image.

mod canonical;
mod lens;
mod opencv;
mod pinhole;

pub use canonical::{
    CANONICAL_HEIGHT, CANONICAL_WIDTH, CanonicalWarp, TRAINING_FOCAL, canonical_camera, training_camera,
};
pub use lens::Lens;
pub use opencv::least_squares;
pub use pinhole::Camera;
