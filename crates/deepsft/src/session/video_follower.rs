//! One target followed through one video that waits for its finders.

use super::exchange::{Answer, Followed, SessionOptions, Source, TargetId};
use super::video_session::Session;
use crate::error::DeepSftError;
use crate::finding::{FinderKind, Sighting, TargetFinder, View};
use deepsft_geometry::tracking::TrackUpdate;
use deepsft_geometry::{CalibratedCamera, Camera};
use serde::{Serialize, Serializer};

/// How a video is followed.
#[derive(Clone, Debug, PartialEq)]
pub struct VideoOptions {
    /// Of the session.
    pub session: SessionOptions,
    /// Frames after which an answer of the finders is handed in, as on a device that follows a camera. Default 4: the 130 ms that a laptop's
    /// CPU takes in a browser, at 30 frames per second. 0: the video waits.
    pub delay: u64,
    /// Standard deviation of the camera's focal length, see [`Source::focal_deviation`]. Default 0: it is known.
    pub focal_deviation: f64,
}

impl Default for VideoOptions {
    fn default() -> Self {
        Self {
            session: SessionOptions::default(),
            delay: 4,
            focal_deviation: 0.0,
        }
    }
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

/// Milliseconds that the stages of a frame took, by the clock that [`VideoFollower::new`] was given.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
#[non_exhaustive]
pub struct FrameTimes {
    /// The finders on this frame, if they were asked about it. A device runs them beside the tracker.
    pub finding: Option<f64>,
    /// The canonical warp.
    pub warp: f64,
    /// The tracker on this frame.
    pub follow: f64,
    /// Taking an answer in: the start of a track, and catching up with the newest frame.
    pub catch_up: Option<f64>,
}

/// A frame that was followed.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct TrackedFrame {
    /// The target in it.
    pub followed: Followed,
    /// Its other copies, where finders look for some ([`TargetFinder::look_for_copies`]).
    pub copies: Vec<Followed>,
    /// The camera of the image in which it was followed: the canonical one, zoomed out while the mesh is too near for that.
    pub view: Camera,
    /// The detection that arrived with the frame, if one did.
    pub detection: Option<Detection>,
    /// What it cost.
    pub times: FrameTimes,
}

/// Follows one target, or as many copies of it as its finder looks for, through one video and answers the session's questions in place: give it every frame in order.
///
/// The clock of the session is that of the video, so that the same video is always followed alike.
pub struct VideoFollower<'a> {
    session: Session,
    finder: &'a mut TargetFinder,
    clock_ms: Box<dyn Fn() -> f64 + Send + 'a>,
    delay: u64,
    focal_deviation: f64,
    /// What the finders make of a frame, when it was asked for, seconds, and the frame with which it is known.
    pending: Option<(u64, f64, Vec<Sighting>)>,
    frame: u64,
}

impl std::fmt::Debug for VideoFollower<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("VideoFollower")
            .field("session", &self.session)
            .field("finder", &self.finder)
            .finish_non_exhaustive()
    }
}

/// The target of the session; its copies have the numbers after it.
const TARGET: TargetId = 0;

impl<'a> VideoFollower<'a> {
    /// Before the first frame of a video that may show the target of `finder`. `clock_ms` gives the time in milliseconds from any origin;
    /// `|| 0.0` for who wants no times.
    ///
    /// # Errors
    /// As [`Session::add`].
    pub fn new(
        finder: &'a mut TargetFinder,
        options: VideoOptions,
        clock_ms: impl Fn() -> f64 + Send + 'a,
    ) -> Result<Self, DeepSftError> {
        let mut session = Session::new(options.session);
        let target = finder.target();
        session.add(TARGET, target.template(), target.training_camera(), finder.can_deny())?;
        for copy in 1..finder.copies() {
            session.add_copy(TARGET + copy, TARGET)?;
        }
        Ok(Self {
            session,
            finder,
            clock_ms: Box::new(clock_ms),
            delay: options.delay,
            focal_deviation: options.focal_deviation,
            pending: None,
            frame: 0,
        })
    }

    /// Follows the next frame, taken at `time_s` (seconds, ascending).
    ///
    /// # Errors
    /// [`DeepSftError::Geometry`] when the image is not of its camera's size, [`DeepSftError::Execution`] when the device
    /// fails.
    pub async fn follow(&mut self, time_s: f64, image: &mut View<'_>) -> Result<TrackedFrame, DeepSftError> {
        let frame = self.frame;
        self.frame += 1;
        let mut times = FrameTimes::default();
        let mut detection = self.hand_in(frame, time_s, &mut times)?;
        if self.pending.is_none() {
            // The finders have failed on the frame before.
            self.session.withdraw();
        }
        let source = Source {
            camera: *image.camera(),
            focal_deviation: self.focal_deviation,
        };
        let next = self.session.next(&source.camera, time_s);
        let start = (self.clock_ms)();
        image.canonical(&next.view)?;
        times.warp = (self.clock_ms)() - start;
        let is_asked = next.question.is_some();
        if let Some(question) = next.question {
            self.session.ask(question, time_s);
        }
        let start = (self.clock_ms)();
        let mut targets = self.session.frame(time_s, &source, &next.view, image)?.targets;
        times.follow = (self.clock_ms)() - start;
        if is_asked {
            let start = (self.clock_ms)();
            let (sightings, _) = self.finder.find(image, &next.view).await?;
            times.finding = Some((self.clock_ms)() - start);
            self.pending = Some((frame + self.delay, time_s, sightings));
            if let Some(at_once) = self.hand_in(frame, time_s, &mut times)? {
                detection = Some(at_once);
                let told = std::mem::replace(&mut targets, self.session.followed());
                for (now, before) in targets.iter_mut().zip(told) {
                    now.changed ^= before.changed;
                }
            }
        }
        let mut targets = targets.into_iter();
        Ok(TrackedFrame {
            followed: targets.next().unwrap_or_default(),
            copies: targets.collect(),
            view: next.view,
            detection,
            times,
        })
    }

    /// The canonical camera as the video so far tells it, see [`Session::solve_camera`].
    ///
    /// # Errors
    /// As there.
    pub fn solve_camera(&mut self, max_updates: usize) -> Result<Option<CalibratedCamera>, DeepSftError> {
        self.session.solve_camera(TARGET, max_updates)
    }

    /// Hands the answer in that is due with `frame`, if there is one.
    fn hand_in(&mut self, frame: u64, time_s: f64, times: &mut FrameTimes) -> Result<Option<Detection>, DeepSftError> {
        let Some((_, asked_s, sightings)) = self.pending.take_if(|(due, ..)| *due <= frame) else {
            return Ok(None);
        };
        let start = (self.clock_ms)();
        let (by, starts): (Vec<_>, _) = sightings
            .into_iter()
            .map(|sighting| (sighting.by, sighting.vertices_camera))
            .unzip();
        let answer = Answer { target: TARGET, starts };
        let took_s = (time_s - asked_s).max(0.0);
        let effects = self.session.answer(&[answer], time_s, took_s, f64::INFINITY)?;
        times.catch_up = Some((self.clock_ms)() - start);
        Ok(effects.first().map(|effect| Detection {
            of_frame: effect.of_frame,
            by: effect.start.and_then(|start| by.get(start).copied()),
            effect: effect.update,
        }))
    }
}

fn lower_case<S: Serializer>(effect: &TrackUpdate, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.serialize_str(effect.name())
}
