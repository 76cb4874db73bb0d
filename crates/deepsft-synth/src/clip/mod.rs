//! Clips: rendered videos with ground truth.

mod motion;
mod story;

pub use motion::{ClipConfig, ClipMotion, FIRST_CLIP_SEED};
pub use story::{ClipEvent, ClipLength, ClipStory};
