//! Clips: an object that bends and moves smoothly before the camera, as in two hands, and comes back to where it began.
//!
//! The paper records such sequences with a Kinect; ours are rendered, and labelled so. Everything that moves is a
//! trigonometric polynomial of the clip's phase (0 to 1), so a clip loops without a seam and a frame is a pure
//! function of (template, configuration, seed, phase).

use crate::deform::{Bend, ControlPointDeformation, EdgeLengthChange, MOVED, Pulls, Rulings, face_front};
use crate::random::{Stream, between, generator};
use crate::render::{EffectsConfig, LightingConfig};
use crate::scene::SynthConfig;
use deepsft_geometry::glam::{DAffine3, DQuat, DVec2, DVec3};
use deepsft_geometry::{Camera, RigidMotion, Template, catmull_rom};
use rand::Rng;
use std::f64::consts::{FRAC_1_SQRT_2, FRAC_PI_2, PI, TAU};
use std::sync::OnceLock;

/// Clips have seeds of their own, from here on: no training and no evaluation of this project uses them.
pub const FIRST_CLIP_SEED: u64 = 9_000_000;

/// Relative heights of the harmonics of a [`Swing`]: slow movement first, as in a hand that is in no hurry.
const HARMONICS: [f64; 3] = [1.0, 0.45, 0.2];
/// Places of the loop at which a swing's peak is looked for: 85 a period of the fastest harmonic, which puts the peak
/// right to (pi / 85)^2 / 2 = 0.07 %.
const PEAK_STEPS: usize = 256;
/// Steps of the bend's curvature across the sheet.
const BEND_STEPS: usize = 32;
/// Distance of the rulings' apex from the sheet's centre, sheet diagonals: a cone near, all but a cylinder far.
const APEX_DIAGONALS: [f64; 2] = [1.2, 3.0];
/// Fraction of the bend that curves the sheet to one side; the rest makes an S of it.
const ONE_SIDED: f64 = 0.75;
/// Fraction of the room beside the sheet that it uses when it moves sideways.
const ROOM_FRACTION: f64 = 0.85;
/// Softness of the limit at which there is no room left, pixels of a 480-pixel row.
const ROOM_SOFTNESS: f64 = 10.0;

/// Shapes of a solid in a loop: from one to the next a limb turns by a few degrees.
const SHAPES: usize = 32;
/// Index of the generator of how a solid bends.
const BENDING_INDEX: u64 = 2;

/// Least and greatest depth (z) of the sheet's centroid in clips, mm: all of an A4 sheet is in the training camera's view
/// nearly always.
pub(crate) const DISTANCE_MM: [f64; 2] = [330.0, 600.0];
/// Greatest angle between the sheet's mean normal and the camera's axis, and greatest in-plane rotation to either side, degrees.
pub(crate) const MAX_TILT_DEG: f64 = 42.0;
const MAX_ROLL_DEG: f64 = 18.0;
/// Greatest angle through which the sheet turns across its bend, radians (the integral of |curvature|); more hides parts of
/// the sheet behind others.
const MAX_BEND_RAD: f64 = 1.7;
/// Greatest angle of the rulings' mean direction to the template's y axis, to either side, radians: bends across the sheet
/// and towards its corners.
const MAX_RULING_RAD: f64 = 0.8;

impl SynthConfig {
    /// Returns the surroundings of clips as a good camera in a lit room has them. Light, background, hands and camera effects
    /// are as in training but mild; pose and shape are the [`ClipMotion`]'s.
    pub fn for_clips(camera: Camera) -> Self {
        Self {
            camera,
            occluder_probability: 1.0,
            distractor_probability: 0.0,
            lighting: LightingConfig {
                max_angle_deg: 50.0,
                ambient_fraction: [0.45, 0.7],
                white_level: [0.8, 0.95],
                tint: 0.06,
                shadow_probability: 0.0,
                roughness: [0.4, 0.7],
                specular: [0.1, 0.5],
                ..LightingConfig::default()
            },
            effects: EffectsConfig {
                gain: [0.95, 1.05],
                white_balance: 0.03,
                gamma: [0.95, 1.05],
                contrast: [0.95, 1.05],
                saturation: [0.95, 1.1],
                defocus_px: [0.4, 0.6],
                motion_probability: 0.0,
                sharpening_probability: 0.0,
                noise_levels: [0.8, 1.5],
                vignetting: [0.0, 0.15],
                jpeg_probability: 0.0,
                bars_probability: 0.0,
                ..EffectsConfig::default()
            },
            ..Self::default()
        }
    }
}

/// The motion of one clip.
///
/// In every frame the sheet is one exact developable, a generalised cone whose rulings, curvature and apex drift
/// (our choice; real paper also folds), so that edges keep their length up to the chords of the mesh. A template
/// that is no sheet moves rigidly; in a [`ClipStory`](crate::ClipStory) it also bends.
///
/// ```
/// use deepsft_geometry::{Picture, Template, training_camera};
/// use deepsft_synth::{ClipMotion, FIRST_CLIP_SEED, SynthConfig, Synthesizer};
/// let template = Template::thin_shell(Picture::from_fn(64, 48, |x, _| [4 * x as u8; 3]), 297.0, 210.0)?;
/// let camera = training_camera();
/// let motion = ClipMotion::new(&template, &camera, FIRST_CLIP_SEED);
/// let synthesizer = Synthesizer::new(&template, SynthConfig::for_clips(camera))?;
/// let scene = synthesizer.scene(FIRST_CLIP_SEED, 0);
/// let frames = (0..2).map(|k| scene.render(motion.vertices_camera(k as f64 / 2.0), k));
/// assert!(frames.collect::<Result<Vec<_>, _>>()?.iter().all(|frame| frame.has_template));
/// # Ok::<(), deepsft_synth::SynthError>(())
/// ```
#[derive(Clone, Debug)]
pub struct ClipMotion<'a> {
    template: &'a Template,
    camera: Camera,
    distance_mm: [f64; 2],
    /// Distance, way across and down, pitch, yaw, roll.
    poses: [Swing; 6],
    /// Ruling, apex, arch and wave of a sheet's bend.
    bends: [Swing; 4],
    bending: Option<Bending<'a>>,
}

/// How a solid bends in the course of a loop: control points swing, each in its own time.
#[derive(Clone, Debug)]
struct Bending<'a> {
    control_points: &'a ControlPointDeformation,
    most: EdgeLengthChange,
    pulls: Pulls,
    swings: [Swing; MOVED[1]],
    /// Its shapes at equal steps of the loop, made when first needed.
    shapes: OnceLock<Vec<Vec<DVec3>>>,
}

impl<'a> ClipMotion<'a> {
    /// Draws the motion of clip `seed` ([`FIRST_CLIP_SEED`] and above by convention) of a template before a camera.
    pub fn new(template: &'a Template, camera: &Camera, seed: u64) -> Self {
        Self::at(DISTANCE_MM, template, camera, seed)
    }

    /// [`ClipMotion::new`] with the sheet's centroid at other depths, mm.
    pub(crate) fn at(distance_mm: [f64; 2], template: &'a Template, camera: &Camera, seed: u64) -> Self {
        let mut rng = generator(seed, 0, Stream::Motion);
        Self {
            template,
            camera: *camera,
            distance_mm,
            poses: std::array::from_fn(|_| Swing::sample(&mut rng)),
            bends: std::array::from_fn(|_| Swing::sample(&mut rng)),
            bending: None,
        }
    }

    /// The same motion, of a solid that its control points bend, within bounds on the change of its edge lengths.
    pub(crate) fn bent_by(
        mut self,
        (control_points, most): (&'a ControlPointDeformation, EdgeLengthChange),
        seed: u64,
    ) -> Self {
        let mut rng = generator(seed, BENDING_INDEX, Stream::Motion);
        self.bending = Some(Bending {
            control_points,
            most,
            pulls: control_points.draw(&mut rng),
            swings: std::array::from_fn(|_| Swing::sample(&mut rng)),
            shapes: OnceLock::new(),
        });
        self
    }

    /// The vertices of the template's mesh at `phase`, mm, camera frame. Phase 1 is phase 0 again.
    pub fn vertices_camera(&self, phase: f64) -> Vec<DVec3> {
        self.turned_vertices_camera(phase, 0.0)
    }

    /// The same, after the object was turned by `turn` radians about its upright axis.
    pub(crate) fn turned_vertices_camera(&self, phase: f64, turn: f64) -> Vec<DVec3> {
        let rest = self.template.mesh().vertices();
        let mut vertices = rest.to_vec();
        if self.template.is_sheet() {
            self.bend(phase).apply(rest, &mut vertices);
        }
        face_front(self.template.mesh(), &mut vertices);
        if let Some(bent) = self.bending.as_ref().and_then(|bending| bending.at(phase)) {
            // Of a surface that closes, or nearly so, the mean normal says nothing: the rest shape faces the front.
            let pairs = rest.iter().zip(&vertices).map(|(&from, &to)| (from, to, 1.0));
            let front = RigidMotion::align(pairs, RigidMotion::IDENTITY);
            vertices = bent.into_iter().map(|p| front.apply(p)).collect();
        }
        let pose = self.pose(phase) * DAffine3::from_rotation_y(turn);
        vertices.into_iter().map(|p| pose.transform_point3(p)).collect()
    }

    fn bend(&self, phase: f64) -> Bend {
        let radius = self.template.size_mm().length() / 2.0;
        let [near, far] = APEX_DIAGONALS.map(|diagonals| 2.0 * radius * diagonals);
        let [ruling, apex, arch, wave] = self.bends.map(|swing| swing.at(phase));
        let distance = middle([near, far], apex);
        let towards_apex = DVec2::from_angle(FRAC_PI_2 + MAX_RULING_RAD * ruling);
        let rulings = Rulings::Conical {
            apex: towards_apex * distance,
            ray: -towards_apex,
            turn: 1.0,
        };
        // The rulings that meet the circle around the sheet.
        let reach = (radius / distance).asin();
        let (arch, wave) = (ONE_SIDED * arch, (1.0 - ONE_SIDED) * wave);
        let step = 2.0 / BEND_STEPS as f64;
        let angles: [f64; BEND_STEPS] = std::array::from_fn(|i| {
            let x = (i as f64 + 0.5) * step - 1.0;
            let bump = 1.0 + (PI * x).cos();
            // From -1 to 1 the bump has the integral 2, |x| times the bump 1 - 4 / pi^2.
            MAX_BEND_RAD * step * bump * (arch / 2.0 + wave * x / (1.0 - 4.0 / (PI * PI)))
        });
        Bend::new(rulings, -reach, 2.0 * reach, &angles)
    }

    /// The pose `camera_from_template` of the bent sheet, whose mean is at the origin and faces -z.
    fn pose(&self, phase: f64) -> DAffine3 {
        let [distance, across, down, pitch, yaw, roll] = self.poses.map(|swing| swing.at(phase));
        let depth = middle(self.distance_mm.map(f64::ln), distance).exp();
        // Each of the two stays below the limit / sqrt 2: together they stay below the limit.
        let tilt = DVec2::new(pitch, yaw) * FRAC_1_SQRT_2;
        let tilt = DQuat::from_scaled_axis((tilt * MAX_TILT_DEG.to_radians()).extend(0.0));
        let roll = DQuat::from_rotation_z(MAX_ROLL_DEG.to_radians() * roll);
        let image = self.camera.size().as_dvec2();
        let softness = ROOM_SOFTNESS * image.x / 480.0;
        let size = self.template.extent_mm().truncate();
        let room = (image - self.camera.focal() * size / depth) / 2.0;
        let room = DVec2::new(softly_positive(room.x, softness), softly_positive(room.y, softness));
        let shift = ROOM_FRACTION * room * DVec2::new(across, down);
        let centroid = self.camera.unproject(image / 2.0 + shift, depth);
        DAffine3::from_rotation_translation(tilt * roll, centroid)
    }
}

impl Bending<'_> {
    /// The shape at `phase`, mm, template frame: between shapes that are as rigid as possible (Catmull-Rom). `None` where every bend
    /// stretches it too much.
    fn at(&self, phase: f64) -> Option<Vec<DVec3>> {
        let shapes = self.shapes.get_or_init(|| {
            let phases = (0..SHAPES).map(|k| k as f64 / SHAPES as f64);
            let strengths = phases.map(|phase| move |pull: usize| self.swings[pull].at(phase));
            self.control_points.shapes(&self.pulls, self.most, strengths)
        });
        let at = phase.rem_euclid(1.0) * SHAPES as f64;
        let weights = catmull_rom(at.fract());
        let near = |k: usize| shapes.get((at as usize + SHAPES - 1 + k) % SHAPES);
        let near = [near(0)?, near(1)?, near(2)?, near(3)?];
        let between = |i: usize| (0..4).map(|k| weights[k] * near[k][i]).sum();
        Some((0..near[0].len()).map(between).collect())
    }
}

/// A smooth function of the phase, with period 1 and between -1 and 1: a sum of [`HARMONICS`] with random phases.
#[derive(Clone, Copy, Debug)]
struct Swing {
    phases: [f64; HARMONICS.len()],
    scale: f64,
}

impl Swing {
    fn sample<R: Rng + ?Sized>(rng: &mut R) -> Self {
        let phases = HARMONICS.map(|_| between([0.0, TAU], rng));
        let mut swing = Self { phases, scale: 1.0 };
        let peak = (0..PEAK_STEPS)
            .map(|i| swing.at(i as f64 / PEAK_STEPS as f64).abs())
            .fold(0.0, f64::max);
        // The first harmonic is higher than the others together: the peak is not near zero.
        swing.scale = 1.0 / peak;
        swing
    }

    fn at(&self, phase: f64) -> f64 {
        let harmonic =
            |(k, (height, start)): (usize, (&f64, &f64))| height * (TAU * (k + 1) as f64 * phase + start).sin();
        let harmonics = HARMONICS.iter().zip(&self.phases).enumerate();
        self.scale * harmonics.map(harmonic).sum::<f64>()
    }
}

/// The range's lower end at -1, its upper end at 1, linear between.
fn middle([low, high]: [f64; 2], at: f64) -> f64 {
    f64::midpoint(low, high) + (high - low) / 2.0 * at
}

/// x where it is well above zero, nearly 0 where it is well below, smooth between.
fn softly_positive(x: f64, softness: f64) -> f64 {
    (x + x.hypot(softness)) / 2.0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_swing_fills_its_range() {
        let mut rng = generator(FIRST_CLIP_SEED, 1, Stream::Motion);
        for _ in 0..50 {
            let swing = Swing::sample(&mut rng);
            let peak = (0..5000)
                .map(|i| swing.at(f64::from(i) / 5000.0).abs())
                .fold(0.0, f64::max);
            assert!((1.0..1.001).contains(&peak), "{peak}");
            assert!((swing.at(0.3) - swing.at(1.3)).abs() < 1e-12);
        }
    }
}
