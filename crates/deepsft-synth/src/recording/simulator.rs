//! Simulated RGB-D recordings, made in a second renderer setting. Training steps 2 and 3 can run on them and be measured
//! without a sensor. Every result on them must be called simulated.

use crate::canonical_truth::canonical_truth;
use crate::clip::{ClipMotion, LOOP_S};
use crate::deform::centroid;
use crate::error::SynthError;
use crate::random::{Stream, generator, mix, uniform};
use crate::recording::depth_camera::{SeenDepth, measure};
use crate::recording::print_response::PrintResponse;
use crate::recording::sensor::RgbdSensor;
use crate::render::{EffectsConfig, Frame, LightingConfig, each_seen};
use crate::sample::Sample;
use crate::scene::occluder::covered_by;
use crate::scene::{Scene, SynthConfig, Synthesizer};
use deepsft_geometry::glam::{DAffine3, DQuat, DVec3, Vec3};
use deepsft_geometry::raster::VisibleSurface;
use deepsft_geometry::{Camera, CanonicalWarp, Template, training_camera};
use rand::RngExt;

/// The colour pictures are half as large as the Kinect v2's: still finer than the canonical image.
const COLOR_BINNING: usize = 2;
/// The Kinect v2's depth camera: its image and the intrinsics that its maker burns in, about.
const DEPTH_CAMERA: ((usize, usize), [f64; 2], [f64; 2]) = ((512, 424), [365.5, 365.5], [257.0, 206.0]);
/// Where the depth camera stands in the colour camera's frame, mm, and how it is turned about y, radians.
const DEPTH_PLACE_MM: DVec3 = DVec3::new(52.0, -0.5, -1.5);
const DEPTH_TURN: f64 = 0.006;

const INSTANTS: usize = 3;
/// Thickness of a hand on either side of the sheet, mm.
const HAND_MM: f64 = 18.0;
/// Distance of the wall behind, mm, and of the things that stand before it, fractions of the wall's.
const WALL_MM: [f64; 2] = [1300.0, 2200.0];
const CLUTTER: [f64; 2] = [0.75, 0.95];
/// Most things before the wall.
const MAX_CLUTTER: usize = 6;

/// Time for which the colour camera gathers light, s.
const EXPOSURE_S: f64 = 1.0 / 60.0;
/// Least and greatest depth of the sheet's centroid, mm, since a Kinect v2 measures nothing below 500 mm.
const DISTANCE_MM: [f64; 2] = [560.0, 820.0];

impl SynthConfig {
    /// The second renderer setting, for simulated recordings seen by `camera`. Light is harder and more coloured and
    /// comes from one side, paper is glossy, the camera is duller and noisier. Shadows fall, other sheets lie behind,
    /// and hands are before the sheet. Values that the training distribution has too are at its end.
    pub fn for_simulated_recordings(camera: Camera) -> Self {
        Self {
            distractor_probability: 0.6,
            max_occluded: 1.0,
            lighting: LightingConfig {
                max_angle_deg: 65.0,
                ambient_fraction: [0.2, 0.45],
                white_level: [0.55, 0.9],
                tint: 0.3,
                shadow_probability: 0.5,
                roughness: [0.22, 0.45],
                specular: [0.5, 1.3],
                ..LightingConfig::default()
            },
            effects: EffectsConfig {
                gain: [1.05, 1.4],
                white_balance: 0.1,
                gamma: [0.85, 1.0],
                contrast: [0.9, 1.0],
                saturation: [0.75, 0.95],
                defocus_px: [0.6, 1.2],
                sharpening_probability: 0.5,
                noise_levels: [2.0, 5.0],
                vignetting: [0.1, 0.3],
                ..SynthConfig::for_clips(camera).effects
            },
            ..Self::for_clips(camera)
        }
    }
}

/// Makes simulated recordings of a template. A frame is a pure function of (template, configuration, seed, number).
///
/// ```
/// use deepsft_geometry::{Picture, Template};
/// use deepsft_synth::RecordingSimulator;
/// let template = Template::thin_shell(Picture::from_fn(64, 48, |x, _| [4 * x as u8; 3]), 297.0, 210.0)?;
/// let simulator = RecordingSimulator::new(&template, false, 1)?;
/// let frame = simulator.take(0).frame(0)?;
/// assert!(simulator.sensor().simulated && frame.truth.has_template);
/// assert!(frame.depth.iter().any(|&units| units > 0));
/// # Ok::<(), deepsft_synth::SynthError>(())
/// ```
#[derive(Clone, Debug)]
pub struct RecordingSimulator {
    /// Of the printed template, for the colour camera.
    synthesizer: Synthesizer,
    print: PrintResponse,
    sensor: RgbdSensor,
    conditions_change: bool,
    seed: u64,
}

/// A frame of a simulated recording.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct SimulatedFrame {
    /// The colour camera's picture with the truth in its image: [`SimulatedFrame::truth`] is in the canonical one.
    pub color: Sample,
    /// The depth camera's picture: millimetres, 0 where nothing was measured.
    pub depth: Vec<u16>,
    /// The frame as the training camera would have taken it, with the truth there.
    pub truth: Sample,
}

/// A stretch of a recording with one motion and one scene.
#[derive(Debug)]
pub struct Take<'a> {
    simulator: &'a RecordingSimulator,
    number: usize,
    scene: Scene<'a>,
    motion: ClipMotion<'a>,
    room: Vec<SeenDepth>,
}

impl RecordingSimulator {
    /// Frames per second: every sixth of a camera at 30, since neighbouring frames hardly differ.
    pub const FRAMES_PER_S: f64 = 5.0;

    /// Frames of one take; the next has another motion, another background and other hands.
    pub const FRAMES_PER_TAKE: usize = 20;

    /// A recording of `template`; `seed` draws the print, the motions and everything around. `conditions_change`: whether
    /// light, paper and camera settings change from take to take, or all takes are of one place and one print. The paper's
    /// split is harder: its test videos have viewpoints and manipulations that its training videos do not show.
    ///
    /// # Errors
    /// [`SynthError::Geometry`] from the cameras.
    pub fn new(template: &Template, conditions_change: bool, seed: u64) -> Result<Self, SynthError> {
        let print = PrintResponse::sample(&mut generator(seed, 0, Stream::Recording));
        let printed = template.clone().with_texture(print.apply(template.texture()));
        let sensor = sensor()?;
        Ok(Self {
            synthesizer: Synthesizer::new(&printed, SynthConfig::for_simulated_recordings(sensor.color))?,
            print,
            sensor,
            conditions_change,
            seed,
        })
    }

    /// The simulated sensor: a colour camera with half the pixels of a Kinect v2's and its depth camera beside it.
    pub fn sensor(&self) -> &RgbdSensor {
        &self.sensor
    }

    /// The print that the recording shows in the template's place.
    pub fn print(&self) -> &PrintResponse {
        &self.print
    }

    /// The configuration of the renderer.
    pub fn renderer(&self) -> &SynthConfig {
        self.synthesizer.config()
    }

    /// Take `number`.
    pub fn take(&self, number: usize) -> Take<'_> {
        let index = number as u64;
        let first = (!self.conditions_change).then(|| self.synthesizer.scene(self.seed, 0));
        let mut scene = self.synthesizer.scene_like(first.as_ref(), self.seed, index);
        // The paper's discs have a size in pixels, which two cameras do not share.
        scene.keep_bodies();
        Take {
            simulator: self,
            number,
            scene,
            // The training camera's view is narrower than the colour camera's, and what it sees is what counts.
            motion: ClipMotion::at(
                DISTANCE_MM,
                self.synthesizer.template(),
                &training_camera(),
                mix(mix(self.seed) ^ index),
            ),
            room: self.room(number),
        }
    }

    /// What the depth camera sees without sheet and hands: a wall and things before it.
    fn room(&self, number: usize) -> Vec<SeenDepth> {
        let mut rng = generator(self.seed, number as u64, Stream::Recording);
        let camera = &self.sensor.depth;
        let (width, height) = (camera.size().width, camera.size().height);
        let wall = f64::from(uniform(&mut rng, WALL_MM));
        let mut room = vec![SeenDepth::facing(wall); width * height];
        for _ in 0..rng.random_range(0..=MAX_CLUTTER) {
            let depth_mm = wall * f64::from(uniform(&mut rng, CLUTTER));
            let [x, y] = [0; 2].map(|_| rng.random::<f64>());
            let [w, h] = [0; 2].map(|_| f64::from(uniform(&mut rng, [0.05, 0.3])));
            let range = |at: f64, half: f64, side: usize| {
                let end = (((at + half) * side as f64) as usize).min(side);
                (((at - half).max(0.0) * side as f64) as usize).min(end)..end
            };
            for row in range(y, h / 2.0, height) {
                for column in range(x, w / 2.0, width) {
                    room[row * width + column].depth_mm = depth_mm;
                }
            }
        }
        room
    }
}

impl Take<'_> {
    /// Frame `index` of the take.
    ///
    /// # Errors
    /// [`SynthError::Geometry`] when the template's mesh has no finite shape.
    pub fn frame(&self, index: usize) -> Result<SimulatedFrame, SynthError> {
        let at = |offset: f64| {
            let time = index as f64 / RecordingSimulator::FRAMES_PER_S + offset * EXPOSURE_S;
            scaled(self.motion.vertices_camera(time / LOOP_S), self.simulator.print.scale)
        };
        let moments = (0..INSTANTS)
            .map(|k| (at((k as f64 + 0.5) / INSTANTS as f64 - 0.5), None))
            .collect();
        let number = (self.number * RecordingSimulator::FRAMES_PER_TAKE + index) as u64;
        let color = self.scene.expose(moments, mix(self.simulator.seed) ^ number)?;
        let depth = self.depth(&color.vertices_camera, number);
        let truth = self.truth(&color)?;
        Ok(SimulatedFrame { color, depth, truth })
    }

    /// The depth camera's picture of the sheet at `vertices_camera`, in the colour camera's frame.
    fn depth(&self, vertices_camera: &[DVec3], number: u64) -> Vec<u16> {
        let camera = &self.simulator.sensor.depth;
        let depth_from_color = self.simulator.sensor.color_from_depth.inverse();
        let vertices = vertices_camera.iter().map(|&p| depth_from_color.transform_point3(p));
        let vertices: Vec<DVec3> = vertices.collect();
        let middle = centroid(&vertices).z;
        let (width, height) = (camera.size().width, camera.size().height);
        let bodies = self.scene.bodies(camera, &vertices);
        // Only its size is asked for.
        let frame = Frame::filled(width, height, Vec3::ZERO);
        let mut seen = self.room.clone();
        for pixel in bodies.iter().flat_map(|body| covered_by(&body.behind, &frame)) {
            seen[pixel] = SeenDepth::facing(middle + HAND_MM);
        }
        let sheet = VisibleSurface::new(self.simulator.synthesizer.template().mesh(), &vertices, camera);
        each_seen(&sheet, |pixel, depth_mm, cosine| {
            seen[pixel] = SeenDepth { depth_mm, cosine }
        });
        for pixel in bodies.iter().flat_map(|body| covered_by(&body.front, &frame)) {
            let sheet = seen[pixel].depth_mm.min(middle + HAND_MM);
            seen[pixel] = SeenDepth::facing(sheet - HAND_MM);
        }
        let mut rng = generator(self.simulator.seed, number, Stream::DepthNoise);
        measure(&seen, width, &mut rng)
    }

    /// The colour camera's frame as the training camera would have taken it, with exact maps of what the colour
    /// camera saw.
    fn truth(&self, color: &Sample) -> Result<Sample, SynthError> {
        let canonical = training_camera();
        let truth = canonical_truth(color, self.simulator.synthesizer.template().mesh(), &canonical);
        Ok(Sample {
            image: CanonicalWarp::new(&color.camera, &canonical).apply(&color.image)?,
            has_template: truth.area() > 0,
            truth,
            camera: canonical,
            ..color.clone()
        })
    }
}

fn scaled(mut vertices: Vec<DVec3>, scale: f64) -> Vec<DVec3> {
    let centre = centroid(&vertices);
    vertices.iter_mut().for_each(|p| *p = centre + (*p - centre) * scale);
    vertices
}

fn sensor() -> Result<RgbdSensor, SynthError> {
    #[expect(
        clippy::expect_used,
        reason = "a constant name, which every recording's test asks for"
    )]
    let kinect = Camera::preset("kinect-v2").expect("the paper has this camera");
    let (depth_size, focal, centre) = DEPTH_CAMERA;
    Ok(RgbdSensor {
        depth: Camera::pinhole(depth_size, focal.into(), centre.into())?,
        color_from_depth: DAffine3::from_rotation_translation(DQuat::from_rotation_y(DEPTH_TURN), DEPTH_PLACE_MM),
        simulated: true,
        ..RgbdSensor::registered(kinect.resized((
            kinect.size().width / COLOR_BINNING,
            kinect.size().height / COLOR_BINNING,
        ))?)
    })
}
