//! One object followed through one video.

use super::pace::NetworkPace;
use crate::error::DeepSftError;
use crate::estimator::Estimator;
use deepsft_geometry::tracking::{OneEuro, OneEuroOptions, TrackUpdate, Tracked, Tracker, TrackingOptions};
use deepsft_geometry::{Maps, Picture, Template};
use serde::{Serialize, Serializer};

/// How a video is followed.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct VideoOptions {
    /// Which frames the network sees.
    pub pace: NetworkPace,
    /// How the tracker fits the mesh to a frame.
    pub tracking: TrackingOptions,
    /// Smoothing of the mesh over time; `None` leaves it as it was fitted.
    pub smoothing: Option<OneEuroOptions>,
}

/// A detection of the network that arrived.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct Detection {
    /// The frame that it is about.
    pub of_frame: u64,
    /// Whether the network sees the object there.
    pub found: bool,
    /// What it did to the track; written as its name in lower case.
    #[serde(serialize_with = "lower_case")]
    pub effect: TrackUpdate,
}

impl Detection {
    /// Whether the track begins, or begins anew, with it.
    pub fn begins_a_track(&self) -> bool {
        matches!(self.effect, TrackUpdate::Started | TrackUpdate::Restarted)
    }

    /// The name of its effect: `started`, `confirmed`, `restarted`, `dropped` or `ignored`.
    pub fn effect_name(&self) -> &'static str {
        name(self.effect)
    }
}

/// Milliseconds that the stages of a frame took, by the clock that [`VideoTracker::new`] was given.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct FrameTimes {
    /// The network on this frame, if it started on it. A device runs it beside the tracker.
    pub network: Option<f64>,
    /// The tracker on this frame.
    pub follow: f64,
    /// Taking a detection in: the start of a track, and catching up with the newest frame.
    pub catch_up: Option<f64>,
}

/// A frame that was followed.
#[derive(Clone, Debug)]
pub struct TrackedFrame {
    /// Mesh (mm, camera frame) and state of the track, smoothed if [`VideoOptions::smoothing`] asks for it.
    pub tracked: Tracked,
    /// The detection that arrived after the frame, if one did.
    pub detection: Option<Detection>,
    /// What it cost.
    pub times: FrameTimes,
}

/// Follows one object through one video: give it every frame in order.
pub struct VideoTracker<'a> {
    estimator: &'a Estimator,
    clock_ms: Box<dyn Fn() -> f64 + 'a>,
    tracker: Tracker,
    pace: NetworkPace,
    smoothing: Option<OneEuro>,
    pending: Option<PendingDetection>,
    frame: u64,
}

/// What the network makes of a frame, and the frame from which on it is known.
struct PendingDetection {
    of_frame: u64,
    due: u64,
    maps: Option<Maps>,
}

impl<'a> VideoTracker<'a> {
    /// Before the first frame of a video that may show `template`, which `estimator` finds. `clock_ms` gives the time in
    /// milliseconds from any origin; `|| 0.0` for who wants no times.
    ///
    /// # Errors
    /// [`DeepSftError::Geometry`] for tracking options that are none, see [`Tracker::new`].
    pub fn new(
        template: &Template,
        estimator: &'a Estimator,
        options: VideoOptions,
        clock_ms: impl Fn() -> f64 + 'a,
    ) -> Result<Self, DeepSftError> {
        Ok(Self {
            estimator,
            clock_ms: Box::new(clock_ms),
            tracker: Tracker::new(template, options.tracking)?,
            pace: options.pace,
            smoothing: options.smoothing.map(OneEuro::new),
            pending: None,
            frame: 0,
        })
    }

    /// Follows the next frame: its canonical image, taken at `time_s` (seconds, ascending).
    ///
    /// # Errors
    /// [`DeepSftError::Geometry`] when the image is not canonical, [`DeepSftError::Execution`] when the device fails.
    pub async fn follow(&mut self, time_s: f64, canonical: &Picture) -> Result<TrackedFrame, DeepSftError> {
        let frame = self.frame;
        self.frame += 1;
        let mut times = FrameTimes::default();
        let start = (self.clock_ms)();
        self.tracker
            .follow(frame, time_s, canonical, self.estimator.canonical_camera())?;
        times.follow = (self.clock_ms)() - start;
        let mut detection = self.take_due(frame, &mut times)?;
        if self.pace.starts(frame, self.pending.is_some()) {
            let start = (self.clock_ms)();
            let maps = self.estimator.infer(canonical).await?;
            let found = self.estimator.judge(canonical, &maps)?.found;
            times.network = Some((self.clock_ms)() - start);
            self.pending = Some(PendingDetection {
                of_frame: frame,
                due: frame + self.pace.delay(),
                maps: found.then_some(maps),
            });
            // Without a delay it is due at once.
            detection = self.take_due(frame, &mut times)?.or(detection);
        }
        let mut tracked = self.tracker.current().clone();
        if let Some(filter) = &mut self.smoothing {
            // A track that starts again somewhere else is no motion.
            if detection.as_ref().is_some_and(Detection::begins_a_track) {
                filter.reset();
            }
            if tracked.found {
                filter.smooth(time_s, &mut tracked.vertices_camera);
            } else {
                filter.reset();
            }
        }
        Ok(TrackedFrame {
            tracked,
            detection,
            times,
        })
    }

    /// Gives the tracker the detection that is due, if there is one.
    fn take_due(&mut self, frame: u64, times: &mut FrameTimes) -> Result<Option<Detection>, DeepSftError> {
        let Some(pending) = self.pending.take_if(|pending| pending.due <= frame) else {
            return Ok(None);
        };
        let start = (self.clock_ms)();
        let effect = self.tracker.update(pending.of_frame, pending.maps.as_ref())?;
        times.catch_up = Some((self.clock_ms)() - start);
        Ok(Some(Detection {
            of_frame: pending.of_frame,
            found: pending.maps.is_some(),
            effect,
        }))
    }
}

fn name(effect: TrackUpdate) -> &'static str {
    match effect {
        TrackUpdate::Started => "started",
        TrackUpdate::Confirmed => "confirmed",
        TrackUpdate::Restarted => "restarted",
        TrackUpdate::Dropped => "dropped",
        TrackUpdate::Ignored => "ignored",
    }
}

fn lower_case<S: Serializer>(effect: &TrackUpdate, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.serialize_str(name(*effect))
}
