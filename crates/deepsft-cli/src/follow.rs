//! The network and the tracker on one video, in step as on a device.

use anyhow::Result;
use deepsft::{Estimator, ModelBundle};
use deepsft_geometry::tracking::{Answer, OneEuro, OneEuroOptions, Tracked, Tracker, TrackingOptions};
use deepsft_geometry::{Maps, Picture};
use serde::Serialize;
use std::time::Instant;

/// When the network looks at a frame, and when its answer is there.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Pace {
    /// As on a device that follows a camera: the answer comes this many frames after the frame it is about; then the
    /// network starts on the newest frame.
    Delayed(u64),
    /// As where time does not matter: every so many frames, and the video waits for the answer.
    Every(u64),
}

/// An answer of the network that arrived.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct NetworkAnswer {
    /// The frame it is about.
    pub of_frame: u64,
    /// Whether the network sees the object there.
    pub found: bool,
    /// What it did to the track.
    pub effect: &'static str,
}

impl NetworkAnswer {
    /// Whether the track begins, or begins anew, with it.
    pub fn begins_a_track(&self) -> bool {
        matches!(self.effect, "started" | "restarted")
    }
}

/// Milliseconds of what was done at a frame.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct FrameTimes {
    /// The network on this frame, if it started on it; a device does it beside the tracking.
    pub network: Option<f64>,
    /// Following the object to this frame.
    pub follow: f64,
    /// Taking in an answer of the network: a start, and catching up with the newest frame.
    pub answer: Option<f64>,
}

/// A frame that was followed.
pub struct Followed {
    /// Mesh and state; smoothed if that is wanted.
    pub tracked: Tracked,
    /// The answer that arrived after the frame, if one did.
    pub answer: Option<NetworkAnswer>,
    /// What the frame cost.
    pub times: FrameTimes,
}

/// Follows one object through one video.
pub struct Follower<'a> {
    estimator: &'a Estimator,
    tracker: Tracker,
    pace: Pace,
    smoothing: Option<OneEuro>,
    waiting: Option<Waiting>,
    frame: u64,
}

/// What the network says of a frame, and from when on it is known.
struct Waiting {
    of_frame: u64,
    due: u64,
    maps: Option<Maps>,
}

impl<'a> Follower<'a> {
    /// Before the first frame of a video.
    pub fn new(bundle: &ModelBundle, estimator: &'a Estimator, pace: Pace, smooth: bool) -> Result<Self> {
        Ok(Self {
            estimator,
            tracker: Tracker::new(bundle.template(), TrackingOptions::default())?,
            pace,
            smoothing: smooth.then(|| OneEuro::new(OneEuroOptions::default())),
            waiting: None,
            frame: 0,
        })
    }

    /// The next frame: its canonical image at `time_s`.
    pub fn follow(&mut self, time_s: f64, canonical: &Picture) -> Result<Followed> {
        let frame = self.frame;
        self.frame += 1;
        let mut times = FrameTimes::default();
        let start = Instant::now();
        self.tracker
            .follow(frame, time_s, canonical, self.estimator.canonical_camera())?;
        times.follow = milliseconds(start);
        let mut answer = self.take_in(frame, &mut times)?;
        if self.starts(frame) {
            let start = Instant::now();
            let maps = pollster::block_on(self.estimator.infer(canonical))?;
            let found = self.estimator.judge(canonical, &maps)?.found;
            times.network = Some(milliseconds(start));
            self.waiting = Some(Waiting {
                of_frame: frame,
                due: frame + self.pace.delay(),
                maps: found.then_some(maps),
            });
            // An answer that is there at once.
            if let Some(taken) = self.take_in(frame, &mut times)? {
                answer = Some(taken);
            }
        }
        let mut tracked = self.tracker.current().clone();
        if let Some(filter) = &mut self.smoothing {
            // A track that starts again somewhere else is no motion.
            if answer.as_ref().is_some_and(|a| a.begins_a_track()) {
                filter.reset();
            }
            if tracked.found {
                filter.smooth(time_s, &mut tracked.vertices_camera);
            } else {
                filter.reset();
            }
        }
        Ok(Followed { tracked, answer, times })
    }

    /// Hands the tracker the answer that is due, if there is one.
    fn take_in(&mut self, frame: u64, times: &mut FrameTimes) -> Result<Option<NetworkAnswer>> {
        let Some(waiting) = self.waiting.take_if(|waiting| waiting.due <= frame) else {
            return Ok(None);
        };
        let start = Instant::now();
        let effect = self.tracker.answer(waiting.of_frame, waiting.maps.as_ref())?;
        times.answer = Some(milliseconds(start));
        Ok(Some(NetworkAnswer {
            of_frame: waiting.of_frame,
            found: waiting.maps.is_some(),
            effect: name(effect),
        }))
    }

    /// Whether the network starts on this frame.
    fn starts(&self, frame: u64) -> bool {
        match self.pace {
            Pace::Delayed(_) => self.waiting.is_none(),
            Pace::Every(frames) => frame.is_multiple_of(frames.max(1)),
        }
    }
}

impl Pace {
    fn delay(self) -> u64 {
        match self {
            Self::Delayed(frames) => frames,
            Self::Every(_) => 0,
        }
    }
}

fn name(effect: Answer) -> &'static str {
    match effect {
        Answer::Started => "started",
        Answer::Confirmed => "confirmed",
        Answer::Restarted => "restarted",
        Answer::Dropped => "dropped",
        Answer::Ignored => "ignored",
    }
}

fn milliseconds(since: Instant) -> f64 {
    since.elapsed().as_secs_f64() * 1000.0
}
