//! Video: the network beside the tracker.
//!
//! The tracker ([`deepsft_geometry::tracking`]) follows the mesh through every frame. The network sees a frame now and
//! then; its detection starts the track, confirms it, or starts it again. [`NetworkPace`] says which frames the network
//! sees and when its detections arrive; [`VideoTracker`] drives both through one video.
//!
//! Nothing here reads a clock or starts a thread: who wants times gives a clock.

mod pace;
mod video_tracker;

pub use pace::NetworkPace;
pub use video_tracker::{Detection, FrameTimes, TrackedFrame, VideoOptions, VideoTracker};
