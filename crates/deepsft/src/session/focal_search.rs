//! When the moving sheet is asked for the camera's focal length, and when its answer is told.

use super::exchange::Source;
use deepsft_geometry::CalibratedCamera;

/// Frames between two steps of the search; each takes about as long as following a frame.
const STEP_FRAMES: u64 = 2;

/// A focal length is told of when its standard deviation is below this fraction of it, and then when it is smaller by a fifth.
const MAX_DEVIATION: f64 = 0.015;
const TOLD_AGAIN: f64 = 0.8;

/// Below this the search is over.
const SOUGHT_DEVIATION: f64 = 0.005;

/// The search for the focal length of the camera that takes the video.
#[derive(Debug, Default)]
pub(super) struct FocalSearch {
    /// Of the last frame.
    source: Option<Source>,
    /// How sure its focal length is: given, or told since.
    deviation: f64,
}

impl FocalSearch {
    /// Whether `source`, which takes the next frame, is not the camera of the last one. All then begins anew, for what was seen until then was
    /// seen through another.
    pub(super) fn begins(&mut self, source: &Source) -> bool {
        let is_other = self.source.replace(*source) != Some(*source);
        if is_other {
            self.deviation = source.focal_deviation;
        }
        is_other
    }

    /// Whether the focal length is not known well enough.
    pub(super) fn goes_on(&self) -> bool {
        self.deviation > SOUGHT_DEVIATION
    }

    /// Whether a step is due in a frame.
    pub(super) fn steps_in(frame: u64) -> bool {
        frame.is_multiple_of(STEP_FRAMES)
    }

    /// Whether a camera that was found is to be told.
    pub(super) fn tells(&mut self, found: &CalibratedCamera) -> bool {
        let tells = found.focal_deviation <= MAX_DEVIATION.min(TOLD_AGAIN * self.deviation);
        if tells {
            self.deviation = found.focal_deviation;
        }
        tells
    }
}
