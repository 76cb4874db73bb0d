//! Clips with something that happens in them, frame by frame with ground truth: what tracking is tried out on.

use crate::clip::motion::ClipMotion;
use crate::deform::centroid;
use crate::error::SynthError;
use crate::random::{Stream, generator, mix};
use crate::sample::Sample;
use crate::scene::occluder::PassingArm;
use crate::scene::{Moment, Scene, SynthConfig, Synthesizer};
use deepsft_geometry::Camera;
use deepsft_geometry::glam::DVec3;
use rand::RngExt;
use std::f64::consts::TAU;
use std::ops::Range;
use std::str::FromStr;

/// Seconds after which a [`ClipMotion`] comes back to where it began: a hand in no hurry, up to 0.6 m/s.
pub(crate) const LOOP_S: f64 = 8.0;

/// Index of the generator of what happens; index 0 is the motion's.
const EVENT_INDEX: u64 = 1;

/// When the arm passes, fractions of the clip.
const PASSING: [f64; 2] = [0.25, 0.75];
/// Earliest and latest cut, fractions of the clip.
const CUT: [f64; 2] = [0.4, 0.6];
/// When the sheet begins to leave, is away, begins to come back and is back, fractions of the clip: in a clip of two
/// seconds it takes 0.6 s to leave, which a hand does at 0.5 to 1.3 m/s.
const LEAVING: [f64; 4] = [0.12, 0.42, 0.55, 0.85];
/// Pixels between the image and the nearest vertex of a sheet that is away.
const AWAY_PX: f64 = 4.0;
/// Instants at which it is checked that the sheet is away.
const AWAY_CHECKS: usize = 16;

/// Mean way of the vertices at a cut, fractions of the image's width: less is not a jump.
const MIN_JUMP: f64 = 0.15;
/// Other motions that are tried for the shot after a cut.
const CUT_TRIES: u64 = 32;

/// Way of a vertex in the image within an exposure, pixels, between two instants of which the exposure is the mean,
/// and the most instants.
const EXPOSURE_STEP_PX: f64 = 1.5;
const MAX_INSTANTS: usize = 13;

/// What happens in a clip.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
#[non_exhaustive]
pub enum ClipEvent {
    /// The sheet moves and bends, nearly always all of it in view.
    Motion,
    /// The same, and an arm passes before it.
    Occlusion,
    /// From one frame to the next the sheet is elsewhere and bent otherwise, as after a cut.
    JumpCut,
    /// The sheet leaves the view, is away for a while, and comes back on the same side.
    Leaving,
    /// Nothing moves; only the sensor noise differs from frame to frame.
    Still,
    /// The object moves and bends, and turns once around its upright axis: all its sides are seen.
    Turning,
}

impl ClipEvent {
    /// All of them.
    pub const ALL: &[Self] = &[
        Self::Motion,
        Self::Occlusion,
        Self::JumpCut,
        Self::Leaving,
        Self::Still,
        Self::Turning,
    ];

    /// A word for it: `motion`, `occlusion`, `jump-cut`, `leaving`, `still` or `turning`.
    pub fn name(self) -> &'static str {
        match self {
            Self::Motion => "motion",
            Self::Occlusion => "occlusion",
            Self::JumpCut => "jump-cut",
            Self::Leaving => "leaving",
            Self::Still => "still",
            Self::Turning => "turning",
        }
    }
}

impl FromStr for ClipEvent {
    type Err = SynthError;

    fn from_str(name: &str) -> Result<Self, SynthError> {
        let known = Self::ALL.iter().copied().find(|event| event.name() == name);
        known.ok_or_else(|| {
            let names: Vec<_> = Self::ALL.iter().map(|event| event.name()).collect();
            SynthError::Refused(format!("expected one of {}", names.join(", ")))
        })
    }
}

/// Length, rate and exposure of a clip.
#[derive(Clone, Debug, PartialEq)]
pub struct ClipLength {
    /// Number of frames.
    pub frames: usize,
    /// Frames a second.
    pub frames_per_s: f64,
    /// Time for which the sensor gathers light, s; at most the time between two frames. What moves is blurred by it.
    /// Default 1/90: a camera indoors.
    pub exposure_s: f64,
}

impl Default for ClipLength {
    /// Two seconds at 30 frames per second.
    fn default() -> Self {
        Self {
            frames: 60,
            frames_per_s: 30.0,
            exposure_s: 1.0 / 90.0,
        }
    }
}

impl SynthConfig {
    /// Returns [`SynthConfig::for_clips`] with the sensor noise of an ordinary camera (1 to 3 grey levels). Hands and things
    /// stay however much they cover: they must not come and go from frame to frame.
    pub fn for_clip_stories(camera: Camera) -> Self {
        let mut config = Self {
            max_occluded: 1.0,
            ..Self::for_clips(camera)
        };
        config.effects.noise_levels = [1.0, 3.0];
        config
    }

    /// Returns the configuration with objects that are no sheets in their rest shape.
    pub fn at_rest(mut self) -> Self {
        self.deformation.max_edge_change.p95 = 0.0;
        self
    }
}

/// A clip and what happens in it. A frame is a pure function of (synthesizer, length, event, seed, number).
///
/// ```
/// use deepsft_geometry::{Picture, Template, training_camera};
/// use deepsft_synth::{ClipEvent, ClipLength, ClipStory, FIRST_CLIP_SEED, SynthConfig, Synthesizer};
/// let template = Template::thin_shell(Picture::from_fn(64, 48, |x, _| [4 * x as u8; 3]), 297.0, 210.0)?;
/// let synthesizer = Synthesizer::new(&template, SynthConfig::for_clip_stories(training_camera()))?;
/// let story = ClipStory::new(&synthesizer, ClipLength::default(), ClipEvent::Leaving, FIRST_CLIP_SEED)?;
/// assert!(story.render(0)?.has_template && !story.render(29)?.has_template);
/// # Ok::<(), deepsft_synth::SynthError>(())
/// ```
#[derive(Debug)]
pub struct ClipStory<'a> {
    synthesizer: &'a Synthesizer,
    scene: Scene<'a>,
    length: ClipLength,
    event: ClipEvent,
    seed: u64,
    motion: ClipMotion<'a>,
    /// The first frame after the cut and the motion from there on.
    cut: Option<(usize, ClipMotion<'a>)>,
    /// Displacement of a sheet that is away, mm, camera frame.
    away: DVec3,
    arm: PassingArm,
}

impl<'a> ClipStory<'a> {
    /// Draws clip `seed` ([`crate::FIRST_CLIP_SEED`] and above by convention).
    ///
    /// # Errors
    /// [`SynthError::Setting`] for a length without frames, a rate that is not positive or an exposure that is longer
    /// than the time between two frames.
    pub fn new(
        synthesizer: &'a Synthesizer,
        length: ClipLength,
        event: ClipEvent,
        seed: u64,
    ) -> Result<Self, SynthError> {
        length.check()?;
        let camera = &synthesizer.config().camera;
        let motion = |seed| {
            let motion = ClipMotion::new(synthesizer.template(), camera, seed);
            match synthesizer.control_points() {
                Some(control_points) => motion.bent_by(control_points, seed),
                None => motion,
            }
        };
        let mut rng = generator(seed, EVENT_INDEX, Stream::Motion);
        let cut_fraction = CUT[0] + (CUT[1] - CUT[0]) * rng.random::<f64>();
        let direction = [DVec3::X, DVec3::NEG_X, DVec3::Y, DVec3::NEG_Y][rng.random_range(0..4)];
        let mut story = Self {
            synthesizer,
            scene: synthesizer.scene(seed, 0),
            event,
            seed,
            motion: motion(seed),
            cut: None,
            away: DVec3::ZERO,
            arm: PassingArm::sample(&mut rng),
            length,
        };
        match event {
            ClipEvent::JumpCut => {
                let first = (cut_fraction * story.length.frames as f64).round() as usize;
                let tries = (1..=CUT_TRIES).map(|k| motion(mix(mix(seed) ^ k)));
                story.cut = story.first_jump(first, tries).map(|after| (first, after));
            }
            ClipEvent::Leaving => story.away = story.way_out(direction),
            _ => {}
        }
        Ok(story)
    }

    /// Number, rate and exposure of the frames.
    pub fn length(&self) -> &ClipLength {
        &self.length
    }

    /// What happens.
    pub fn event(&self) -> ClipEvent {
        self.event
    }

    /// Its seed.
    pub fn seed(&self) -> u64 {
        self.seed
    }

    /// Returns the frames in which it happens. They are those while the arm may be in view; the frame after the cut; those from
    /// where the sheet begins to leave until it is back. Empty where nothing does.
    pub fn event_frames(&self) -> Range<usize> {
        let frames = self.length.frames as f64;
        let between = |[from, to]: [f64; 2]| (from * frames).floor() as usize..(to * frames).ceil() as usize;
        match self.event {
            ClipEvent::Motion | ClipEvent::Still | ClipEvent::Turning => 0..0,
            ClipEvent::Occlusion => between(PASSING),
            ClipEvent::JumpCut => self.cut.as_ref().map_or(0..0, |(first, _)| *first..first + 1),
            ClipEvent::Leaving => between([LEAVING[0], LEAVING[3]]),
        }
    }

    /// The vertices of the template's mesh at `frame`, also between two frames, mm, camera frame.
    pub fn vertices_camera(&self, frame: f64) -> Vec<DVec3> {
        let after = self.cut.as_ref().is_some_and(|(first, _)| frame >= *first as f64);
        self.vertices_of_shot(frame, after)
    }

    /// Frame `frame` with its truth: that of the middle of its exposure.
    ///
    /// # Errors
    /// [`SynthError::Geometry`] when the template's mesh has no finite shape.
    pub fn render(&self, frame: usize) -> Result<Sample, SynthError> {
        let after = self.cut.as_ref().is_some_and(|(first, _)| frame >= *first);
        let exposure = self.length.exposure_s * self.length.frames_per_s;
        let moment = |offset: f64| {
            let at = frame as f64 + offset * exposure;
            let vertices_camera = self.vertices_of_shot(at, after);
            let passing = self.passing_progress(at).map(|fraction| {
                let depth_mm = centroid(&vertices_camera).z;
                self.arm.place(fraction, &self.synthesizer.config().camera, depth_mm)
            });
            (vertices_camera, passing)
        };
        let instants = self.instants(frame as f64, exposure, after);
        let moments: Vec<Moment> = (0..instants)
            .map(|k| moment((k as f64 + 0.5) / instants as f64 - 0.5))
            .collect();
        self.scene.expose(moments, mix(self.seed) ^ frame as u64)
    }

    /// The vertices of the shot before or after the cut.
    fn vertices_of_shot(&self, frame: f64, after: bool) -> Vec<DVec3> {
        let motion = match &self.cut {
            Some((_, motion)) if after => motion,
            _ => &self.motion,
        };
        let frame = if self.event == ClipEvent::Still { 0.0 } else { frame };
        let turn = match self.event {
            ClipEvent::Turning => TAU * frame / self.length.frames as f64,
            _ => 0.0,
        };
        let mut vertices = motion.turned_vertices_camera(frame / self.length.frames_per_s / LOOP_S, turn);
        let away = self.away * self.away_fraction(frame);
        vertices.iter_mut().for_each(|p| *p += away);
        vertices
    }

    /// How far the sheet is on its way out: 0 where it moves as always, 1 where it is away.
    fn away_fraction(&self, frame: f64) -> f64 {
        let [begin, away, turn, back] = LEAVING.map(|fraction| fraction * self.length.frames as f64);
        let out = ((frame - begin) / (away - begin)).clamp(0.0, 1.0);
        let home = ((frame - turn) / (back - turn)).clamp(0.0, 1.0);
        let smooth = |t: f64| t * t * (3.0 - 2.0 * t);
        smooth(out) - smooth(home)
    }

    /// Where on its way the arm is; `None` before and after.
    fn passing_progress(&self, frame: f64) -> Option<f64> {
        let [from, to] = PASSING.map(|fraction| fraction * self.length.frames as f64);
        let fraction = (frame - from) / (to - from);
        (self.event == ClipEvent::Occlusion && (0.0..=1.0).contains(&fraction)).then_some(fraction)
    }

    /// An odd number of instants, so that one is the middle: more where more moves.
    fn instants(&self, frame: f64, exposure: f64, after: bool) -> usize {
        let camera = &self.synthesizer.config().camera;
        let ends = [-0.5, 0.5].map(|offset| self.vertices_of_shot(frame + offset * exposure, after));
        let sheet = ways_px(camera, &ends[0], &ends[1]).fold(0.0, f64::max);
        let passing = (PASSING[1] - PASSING[0]) * self.length.frames as f64;
        let arm = match self.passing_progress(frame) {
            // Its way is a little longer than the image is wide.
            Some(_) => 1.5 * camera.size().width as f64 * exposure / passing,
            None => 0.0,
        };
        let half = (sheet.max(arm) / EXPOSURE_STEP_PX / 2.0).round() as usize;
        (1 + 2 * half).min(MAX_INSTANTS)
    }

    /// The first motion that is a jump at frame `first`, or else the one that jumps farthest.
    fn first_jump(&self, first: usize, tries: impl Iterator<Item = ClipMotion<'a>>) -> Option<ClipMotion<'a>> {
        let camera = &self.synthesizer.config().camera;
        let phase = first as f64 / self.length.frames_per_s / LOOP_S;
        let before = self.motion.vertices_camera(phase);
        let least = MIN_JUMP * camera.size().width as f64;
        let mut farthest = (0.0, None);
        for motion in tries {
            let after = motion.vertices_camera(phase);
            let way = ways_px(camera, &before, &after).sum::<f64>() / before.len().max(1) as f64;
            if way > farthest.0 || farthest.1.is_none() {
                farthest = (way, Some(motion));
            }
            if way >= least {
                break;
            }
        }
        farthest.1
    }

    /// The least displacement along `direction` (an axis of the image) with which the sheet is out of view while it is
    /// to be away.
    fn way_out(&self, direction: DVec3) -> DVec3 {
        let camera = &self.synthesizer.config().camera;
        let [_, from, to, _] = LEAVING.map(|fraction| fraction * self.length.frames as f64);
        // Along x or y; towards the image's end or its beginning.
        let (axis, towards_end) = (direction.abs().truncate(), direction.element_sum() > 0.0);
        let (low, high) = (
            camera.principal_point(),
            camera.size().as_dvec2() - camera.principal_point(),
        );
        let room = axis.dot(if towards_end { high } else { low }) + AWAY_PX;
        let focal = axis.dot(camera.focal());
        // Exposures reach a little beyond the frames.
        let instants = (0..=AWAY_CHECKS).map(|k| from - 1.0 + (to - from + 2.0) * k as f64 / AWAY_CHECKS as f64);
        let needed = instants.flat_map(|frame| {
            let vertices = self.motion.vertices_camera(frame / self.length.frames_per_s / LOOP_S);
            vertices.into_iter().map(|p| room * p.z / focal - p.dot(direction))
        });
        direction * needed.fold(0.0, f64::max)
    }
}

impl ClipLength {
    fn check(&self) -> Result<(), SynthError> {
        let (rate, exposure) = (self.frames_per_s, self.exposure_s);
        let is_within = (0.0..=1.0).contains(&(exposure * rate));
        for (fits, parameter, actual, expected) in [
            (self.frames > 0, "clip.frames", 0.0, "at least 1"),
            (
                rate > 0.0 && rate.is_finite(),
                "clip.frames_per_s",
                rate,
                "a positive number",
            ),
            (
                is_within,
                "clip.exposure_s",
                exposure,
                "0 to the time between two frames",
            ),
        ] {
            if !fits {
                return Err(SynthError::setting(parameter, actual, expected));
            }
        }
        Ok(())
    }
}

fn ways_px(camera: &Camera, from: &[DVec3], to: &[DVec3]) -> impl Iterator<Item = f64> {
    let pairs = from.iter().zip(to);
    pairs.filter_map(|(a, b)| Some(camera.project(*a)?.distance(camera.project(*b)?)))
}
