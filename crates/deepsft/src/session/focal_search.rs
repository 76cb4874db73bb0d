//! When the moving sheet is asked for the camera's focal length, and when its answer is told.

use super::exchange::Source;
use deepsft_geometry::CalibratedCamera;

/// Frames between two steps of the search; each takes about as long as following a frame.
const STEP_FRAMES: u64 = 2;

/// A focal length is told of when its standard deviation is below this fraction of it, and then when it is smaller by a fifth.
const MAX_DEVIATION: f64 = 0.015;
const TOLD_AGAIN: f64 = 0.8;

/// Another focal length than was told, by this many deviations, is told whatever was told before: a phone has changed its lens.
const OTHER_LENS: f64 = 4.0;

/// Below this the search is over.
const SOUGHT_DEVIATION: f64 = 0.005;

/// The search for the focal length of the camera that takes the video.
#[derive(Debug, Default)]
pub(super) struct FocalSearch {
    /// Of the last frame.
    source: Option<Source>,
    /// How sure its focal length is: given, or told since.
    deviation: f64,
    /// ln of the focal length that was told last, beside the source's own.
    told: f64,
}

impl FocalSearch {
    /// Whether `source`, which takes the next frame, is not the camera of the last one. All then begins anew, for what was seen until then was
    /// seen through another.
    pub(super) fn begins(&mut self, source: &Source) -> bool {
        let is_other = self.source.replace(*source) != Some(*source);
        if is_other {
            (self.deviation, self.told) = (source.focal_deviation, 0.0);
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
        let focal = (found.camera.focal().x / found.assumed.focal().x).ln();
        self.is_worth_telling(focal, found.focal_deviation)
    }

    fn is_worth_telling(&mut self, focal: f64, deviation: f64) -> bool {
        let is_of_another_lens = (focal - self.told).abs() > OTHER_LENS * self.deviation.hypot(deviation);
        let is_surer = deviation <= TOLD_AGAIN * self.deviation;
        let tells = deviation <= MAX_DEVIATION && (is_surer || is_of_another_lens);
        if tells {
            (self.deviation, self.told) = (deviation, focal);
        }
        tells
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_focal_length_is_told_again_where_it_is_surer_or_that_of_another_lens() {
        let mut search = FocalSearch {
            deviation: 0.2,
            ..FocalSearch::default()
        };
        // ln of the focal length, its deviation, whether it is told.
        let found = [
            (0.1, 0.03, false),
            (0.1, 0.012, true),
            (0.11, 0.011, false),
            (0.1, 0.009, true),
            (-0.4, 0.014, true),
            (-0.39, 0.013, false),
        ];
        for (focal, deviation, is_told) in found {
            assert_eq!(
                search.is_worth_telling(focal, deviation),
                is_told,
                "{focal}, {deviation}"
            );
        }
    }
}
