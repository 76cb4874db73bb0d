//! Video: the finders beside the tracker.
//!
//! The tracker ([`deepsft_geometry::tracking`]) follows the mesh through every frame. The finders see a frame now and
//! then; their detection starts the track, confirms it, or starts it again. [`FindingPace`] says which frames they
//! see and when their detections arrive; [`VideoTracker`] drives both through one video.
//!
//! Nothing here reads a clock or starts a thread: who wants times gives a clock.

mod pace;
mod video_tracker;
mod view_choice;

pub use pace::FindingPace;
pub use video_tracker::{Detection, FrameTimes, TrackedFrame, VideoOptions, VideoTracker};
