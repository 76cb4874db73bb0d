//! What a session and its caller say to each other.

use deepsft_geometry::glam::DVec3;
use deepsft_geometry::tracking::{OneEuroOptions, TrackUpdate};
use deepsft_geometry::{CalibratedCamera, Camera, Surface};

/// Number of a target, chosen by the caller.
pub type TargetId = u32;

/// Settings of a [`Session`].
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SessionOptions {
    /// Smoothing of the meshes over time; `None` leaves them as they were fitted.
    pub smoothing: Option<OneEuroOptions>,
    /// Finders are asked about every so many frames, for all targets: where time does not matter. 0 counts as 1. `None`: they are asked when
    /// a target is missing or has to be confirmed. Either way no question comes while one waits for its answer.
    pub ask_every: Option<u64>,
}

/// The camera that takes a video.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Source {
    /// Its intrinsics.
    pub camera: Camera,
    /// Standard deviation of its focal length, a fraction of it: infinite for a guess, 0 for one that nobody wants better. Above 0.005 the
    /// moving meshes are asked for it.
    pub focal_deviation: f64,
}

impl From<Camera> for Source {
    /// A camera that is known.
    fn from(camera: Camera) -> Self {
        Self {
            camera,
            focal_deviation: 0.0,
        }
    }
}

/// What the next frame is for.
#[derive(Clone, Debug, PartialEq)]
pub struct Next {
    /// The camera in whose image it is looked at: the canonical one, or one that is zoomed out.
    pub view: Camera,
    /// What finders should be asked about it, if anything.
    pub question: Option<Question>,
    /// Seconds after the frame before; an earlier one is not worth its time.
    pub interval_s: f64,
}

/// A question for the finders about the next frame.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Question {
    /// The targets to look for.
    pub targets: Vec<TargetId>,
    /// Whether all of them are followed well and have a network: then the canonical image is enough.
    pub only_confirms: bool,
}

/// What finders see of one target in the frame they were asked about.
#[derive(Clone, Debug)]
pub struct Answer {
    /// The target.
    pub target: TargetId,
    /// Where they see it, the likeliest first: vertices of its mesh, camera frame, mm. Empty where they do not.
    pub starts: Vec<Vec<DVec3>>,
}

/// What an answer did to a track.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Effect {
    /// The target.
    pub target: TargetId,
    /// The frame that the answer is about.
    pub of_frame: u64,
    /// What happened.
    pub update: TrackUpdate,
    /// Index of the start that was taken, or was tried last.
    pub start: Option<usize>,
}

/// One target in one frame.
#[derive(Clone, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct Followed {
    /// The target.
    pub target: TargetId,
    /// Whether it counts as found.
    pub found: bool,
    /// Whether that has changed since it was last told.
    pub changed: bool,
    /// Whether it is found and the frame does not confirm its mesh, which stands where it was.
    pub held: bool,
    /// Its surface; `None` unless found.
    pub surface: Option<Surface>,
    /// Correlation of image and visible print in this frame, 0 to 1; 0 without a track.
    pub correlation: f64,
    /// Solver steps that the frame took.
    pub iterations: usize,
}

/// A frame that was followed.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct FollowedFrame {
    /// Its number, from 0.
    pub number: u64,
    /// Whether a video begins with it: everything seen before was forgotten.
    pub afresh: bool,
    /// All targets, by number.
    pub targets: Vec<Followed>,
    /// The canonical camera as the moving meshes tell it, when it is known well enough, and again when it is known better.
    pub calibrated: Option<CalibratedCamera>,
}
