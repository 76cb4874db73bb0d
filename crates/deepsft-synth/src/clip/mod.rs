//! Clips: rendered videos with ground truth.

mod folder;
pub(crate) mod motion;
mod story;

pub use folder::{CLIP_FILE, ClipDescription, ClipFolder, TRUTH_FOLDER, frame_name};
pub use motion::{ClipMotion, FIRST_CLIP_SEED};
pub(crate) use story::LOOP_S;
pub use story::{ClipEvent, ClipLength, ClipStory};
