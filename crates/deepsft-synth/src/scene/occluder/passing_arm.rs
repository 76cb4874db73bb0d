//! A forearm that passes before the sheet in a clip, from one side of the view to the other.

use crate::random::uniform;
use crate::render::{Figure, ValueNoise, any_color};
use crate::scene::occluder::body::{ImageOccluder, Part, Surface};
use crate::scene::occluder::hand::skin_color;
use deepsft_geometry::Camera;
use deepsft_geometry::glam::Vec2;
use rand::{Rng, RngExt};

/// Radii of the forearm at the wrist and below the elbow, and of the fist, mm: those of an adult in a sleeve.
const WRIST_MM: [f64; 2] = [30.0, 38.0];
const ELBOW_MM: [f64; 2] = [45.0, 55.0];
const FIST_MM: [f64; 2] = [42.0, 50.0];

/// Distance of the arm, fractions of the sheet's.
const NEARER: [f64; 2] = [0.72, 0.9];

/// Row of the fist, fraction of the image's height: the arm comes from below.
const FIST_ROW: [f64; 2] = [0.15, 0.4];

/// The elbow's column less the fist's, fractions of the image's height.
const SLANT: [f64; 2] = [-0.35, 0.35];

/// The arm of one clip. It does not touch the sheet: it moves across the image at a steady pace.
#[derive(Clone, Debug)]
pub(crate) struct PassingArm {
    parts: [Surface; 2],
    wrist_mm: f32,
    elbow_mm: f32,
    fist_mm: f32,
    nearer: f32,
    fist_row: f32,
    slant: f32,
    from_left: bool,
    noise: ValueNoise,
}

impl PassingArm {
    pub(crate) fn sample<R: Rng + ?Sized>(rng: &mut R) -> Self {
        Self {
            parts: [Surface::Cloth(any_color(rng)), Surface::Skin(skin_color(rng))],
            wrist_mm: uniform(rng, WRIST_MM),
            elbow_mm: uniform(rng, ELBOW_MM),
            fist_mm: uniform(rng, FIST_MM),
            nearer: uniform(rng, NEARER),
            fist_row: uniform(rng, FIST_ROW),
            slant: uniform(rng, SLANT),
            from_left: rng.random(),
            noise: ValueNoise::new(rng),
        }
    }

    /// The arm in the image at `progress` of its way (0: still outside on one side, 1: outside on the other), before a
    /// sheet at `depth_mm`.
    pub(crate) fn place(&self, progress: f64, camera: &Camera, depth_mm: f64) -> ImageOccluder {
        let scale = camera.focal().x as f32 / (depth_mm as f32 * self.nearer);
        let image = Vec2::new(camera.size().width as f32, camera.size().height as f32);
        let slant = self.slant * image.y;
        // Fist and elbow, with their radii, are outside at both ends of the way.
        let reach = self.fist_mm.max(self.elbow_mm) * scale + slant.abs() + 2.0;
        let progress = if self.from_left { progress } else { 1.0 - progress } as f32;
        let fist = Vec2::new(-reach + progress * (image.x + 2.0 * reach), self.fist_row * image.y);
        let elbow = Vec2::new(fist.x + slant, image.y + self.elbow_mm * scale);
        let [sleeve, skin] = self.parts.clone();
        let arm = Figure::Capsule([fist, elbow], [self.wrist_mm * scale, self.elbow_mm * scale]);
        let fist = Figure::disc(fist, self.fist_mm * scale);
        ImageOccluder {
            behind: Vec::new(),
            front: vec![Part::new(arm, sleeve), Part::new(fist, skin)],
            scale,
            shadow: (Vec2::ZERO, 1.0, 0.0),
            noise: self.noise,
        }
    }
}
