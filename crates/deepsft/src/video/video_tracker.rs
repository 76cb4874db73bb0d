//! One object followed through one video.

use super::pace::FindingPace;
use super::view_choice::ViewChoice;
use crate::error::DeepSftError;
use crate::finding::{FinderKind, Sighting, TargetFinder, View};
use deepsft_geometry::Camera;
use deepsft_geometry::tracking::{OneEuro, OneEuroOptions, TrackUpdate, Tracked, Tracker, TrackingOptions};
use serde::{Serialize, Serializer};

/// How a video is followed.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct VideoOptions {
    /// Which frames the finders see.
    pub pace: FindingPace,
    /// How the tracker fits the mesh to a frame.
    pub tracking: TrackingOptions,
    /// Smoothing of the mesh over time; `None` leaves it as it was fitted.
    pub smoothing: Option<OneEuroOptions>,
}

/// What the finders say of a frame, when it arrived.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct Detection {
    /// The frame that it is about.
    pub of_frame: u64,
    /// Which finder sees the object there, if one does. Of several the one that had the effect.
    pub by: Option<FinderKind>,
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
        self.effect.name()
    }
}

/// Milliseconds that the stages of a frame took, by the clock that [`VideoTracker::new`] was given.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
#[non_exhaustive]
pub struct FrameTimes {
    /// The finders on this frame, if they started on it. A device runs them beside the tracker.
    pub finding: Option<f64>,
    /// The canonical warp.
    pub warp: f64,
    /// The tracker on this frame.
    pub follow: f64,
    /// Taking a detection in: the start of a track, and catching up with the newest frame.
    pub catch_up: Option<f64>,
}

/// A frame that was followed.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct TrackedFrame {
    /// Mesh (mm, camera frame) and state of the track, smoothed if [`VideoOptions::smoothing`] asks for it.
    pub tracked: Tracked,
    /// The camera of the image in which it was followed: the canonical one, zoomed out while the mesh is too near for that.
    pub canonical_camera: Camera,
    /// The detection that arrived after the frame, if one did.
    pub detection: Option<Detection>,
    /// What it cost.
    pub times: FrameTimes,
}

/// Follows one object through one video: give it every frame in order.
pub struct VideoTracker<'a> {
    finder: &'a mut TargetFinder,
    clock_ms: Box<dyn Fn() -> f64 + Send + 'a>,
    tracker: Tracker,
    pace: FindingPace,
    view: ViewChoice,
    smoothing: Option<OneEuro>,
    pending: Option<PendingDetection>,
    /// Whether the last sightings started no track: the object may be too near for the view they were seen in.
    in_vain: bool,
    frame: u64,
}

impl std::fmt::Debug for VideoTracker<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("VideoTracker")
            .field("finder", &self.finder)
            .field("pace", &self.pace)
            .field("frame", &self.frame)
            .finish_non_exhaustive()
    }
}

/// What the finders make of a frame, and the frame from which on it is known.
struct PendingDetection {
    of_frame: u64,
    due: u64,
    sightings: Vec<Sighting>,
}

impl<'a> VideoTracker<'a> {
    /// Before the first frame of a video that may show the target of `finder`. `clock_ms` gives the time in milliseconds
    /// from any origin; `|| 0.0` for who wants no times.
    ///
    /// # Errors
    /// [`DeepSftError::Geometry`] for tracking options that are none, see [`Tracker::new`].
    pub fn new(
        finder: &'a mut TargetFinder,
        options: VideoOptions,
        clock_ms: impl Fn() -> f64 + Send + 'a,
    ) -> Result<Self, DeepSftError> {
        Ok(Self {
            clock_ms: Box::new(clock_ms),
            tracker: Tracker::new(finder.target().template(), options.tracking)?,
            finder,
            pace: options.pace,
            view: ViewChoice::default(),
            smoothing: options.smoothing.map(OneEuro::new),
            pending: None,
            in_vain: false,
            frame: 0,
        })
    }

    /// Follows the next frame, taken at `time_s` (seconds, ascending).
    ///
    /// # Errors
    /// [`DeepSftError::Geometry`] when the image is not of its camera's size, [`DeepSftError::Execution`] when the device
    /// fails.
    pub async fn follow(&mut self, time_s: f64, view: &mut View<'_>) -> Result<TrackedFrame, DeepSftError> {
        let frame = self.frame;
        self.frame += 1;
        let is_busy = self.pending.as_ref().is_some_and(|pending| pending.due > frame);
        let starts = self.pace.starts(frame, is_busy);
        let (target, source) = (self.finder.target(), view.camera());
        // Where something was seen the view stays: a track is about to start there.
        let is_seen = !self.in_vain
            && self
                .pending
                .as_ref()
                .is_some_and(|pending| !pending.sightings.is_empty());
        let camera = self
            .view
            .next(target, source, self.tracker.current(), starts && !is_seen);
        let mut times = FrameTimes::default();
        let start = (self.clock_ms)();
        let canonical = view.canonical(&camera)?;
        times.warp = (self.clock_ms)() - start;
        let start = (self.clock_ms)();
        self.tracker.follow(frame, time_s, canonical, &camera)?;
        times.follow = (self.clock_ms)() - start;
        let mut detection = self.take_due(frame, &mut times)?;
        if starts {
            let start = (self.clock_ms)();
            let sightings = self.finder.find(view, &camera).await?;
            times.finding = Some((self.clock_ms)() - start);
            self.pending = Some(PendingDetection {
                of_frame: frame,
                due: frame + self.pace.delay(),
                sightings,
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
            canonical_camera: camera,
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
        let of_frame = pending.of_frame;
        let mut detection = Detection {
            of_frame,
            by: None,
            effect: TrackUpdate::Ignored,
        };
        if pending.sightings.is_empty() && self.finder.can_deny() {
            detection.effect = self.tracker.update(of_frame, None)?;
        }
        for sighting in &pending.sightings {
            detection.by = Some(sighting.by);
            detection.effect = self.tracker.update(of_frame, Some(&sighting.maps))?;
            if detection.effect != TrackUpdate::Ignored {
                break;
            }
        }
        self.in_vain = detection.effect == TrackUpdate::Ignored && !self.tracker.current().found;
        times.catch_up = Some((self.clock_ms)() - start);
        Ok(Some(detection))
    }
}

fn lower_case<S: Serializer>(effect: &TrackUpdate, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.serialize_str(effect.name())
}
