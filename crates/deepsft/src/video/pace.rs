//! Which frames of a video the finders see, and when their detections arrive.

/// Which frames the finders see, and when their detections arrive.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum FindingPace {
    /// As on a device that follows a camera: a detection arrives this many frames after the frame that it is about. Then
    /// the finders start on the newest frame.
    Delayed(u64),
    /// As where time does not matter: the finders see every so many frames, and the video waits for them. 0
    /// counts as 1.
    Every(u64),
}

impl Default for FindingPace {
    /// Four frames of delay: the 130 ms that a laptop's CPU takes in a browser, at 30 frames per second.
    fn default() -> Self {
        Self::Delayed(4)
    }
}

impl FindingPace {
    /// Frames between a frame and the detection about it.
    pub(super) fn delay(self) -> u64 {
        match self {
            Self::Delayed(frames) => frames,
            Self::Every(_) => 0,
        }
    }

    /// Whether the finders start on `frame`; `busy` says whether a detection is still to arrive.
    pub(super) fn starts(self, frame: u64, busy: bool) -> bool {
        match self {
            Self::Delayed(_) => !busy,
            Self::Every(frames) => frame.is_multiple_of(frames.max(1)),
        }
    }
}
