//! The parts that occluders are made of, laid into the image: what they cover, and how they, their surfaces and their
//! shadows are painted.

use crate::render::{Figure, Frame, Lighting, ValueNoise};
use deepsft_geometry::glam::{Vec2, Vec3};
use deepsft_geometry::{Camera, Maps};

/// How much light skin loses towards its outline.
const RIM_DARKENING: f32 = 0.35;

/// The surface of a part.
#[derive(Clone, Debug)]
pub(crate) enum Surface {
    /// Shaded as a rounded body, mottled.
    Skin(Vec3),
    /// A finger nail.
    Nail(Vec3),
    /// A sleeve or any rounded thing.
    Cloth(Vec3),
    /// Flat, with a change of colour across it.
    Flat(Vec3, Vec3),
}

/// A body in the plane of an anchor on the sheet: x along a direction, y across it, in mm.
#[derive(Clone, Debug)]
pub(crate) struct Part {
    pub(crate) figure: Figure,
    pub(crate) surface: Surface,
}

impl Part {
    pub(crate) fn new(figure: Figure, surface: Surface) -> Self {
        Self { figure, surface }
    }
}

/// An occluder's parts laid into the image: figures in pixels.
pub(crate) struct ImageOccluder {
    /// What the sheet hides.
    pub(crate) behind: Vec<Part>,
    pub(crate) front: Vec<Part>,
    /// Pixels per mm.
    pub(super) scale: f32,
    /// Displacement in pixels, softness in pixels and strength of its shadow.
    pub(super) shadow: (Vec2, f32, f32),
    pub(super) noise: ValueNoise,
}

impl ImageOccluder {
    /// Paints the shadow and what is before the sheet, and takes the covered pixels out of the truth.
    pub(crate) fn paint_front(&self, frame: &mut Frame, truth: &mut Maps, light: &Lighting, camera: &Camera) {
        self.paint_shadow(frame);
        self.paint(&self.front, frame, light, camera);
        for pixel in covered_by(&self.front, frame) {
            truth.clear(pixel);
        }
    }

    fn paint_shadow(&self, frame: &mut Frame) {
        let (offset, softness, strength) = self.shadow;
        if strength == 0.0 || self.front.is_empty() {
            return;
        }
        let reach = softness + 1.0;
        let bounds = self.front.iter().map(|part| part.figure.bounds());
        let (low, high) = bounds.fold((Vec2::INFINITY, Vec2::NEG_INFINITY), |(low, high), (a, b)| {
            (low.min(a), high.max(b))
        });
        let (columns, rows) = frame.window((low + offset - reach, high + offset + reach));
        for row in rows {
            for column in columns.clone() {
                let pixel = row * frame.width + column;
                let p = frame.centre(pixel) - offset;
                let distance = self
                    .front
                    .iter()
                    .map(|part| part.figure.distance(p))
                    .fold(f32::INFINITY, f32::min);
                let t = (0.5 - 0.5 * distance / softness).clamp(0.0, 1.0);
                if t > 0.0 {
                    let left = 1.0 - strength * t * t * (3.0 - 2.0 * t);
                    frame.set(pixel, frame.color(pixel) * left);
                }
            }
        }
    }

    /// Paints some of its parts.
    pub(crate) fn paint(&self, parts: &[Part], frame: &mut Frame, light: &Lighting, camera: &Camera) {
        let (focal, principal) = (camera.focal().as_vec2(), camera.principal_point().as_vec2());
        for part in parts {
            let figure = &part.figure;
            let (low, high) = figure.bounds();
            frame.paint(figure, |p| {
                let ray = (p - principal) / focal;
                let round = |albedo: Vec3| {
                    let normal = figure.normal(p);
                    let rim = 1.0 - RIM_DARKENING * (1.0 + normal.z).powi(2);
                    light.matt(albedo, normal, ray) * rim
                };
                let color = match &part.surface {
                    Surface::Skin(albedo) => {
                        let mottled = 1.0 + 0.12 * self.noise.fractal((p - low) / (6.0 * self.scale), 3);
                        round(*albedo * mottled)
                    }
                    Surface::Nail(albedo) => round(*albedo),
                    Surface::Cloth(albedo) => {
                        let folds = 1.0 + 0.2 * self.noise.fractal((p - low) / (20.0 * self.scale), 4);
                        round(*albedo * folds)
                    }
                    Surface::Flat(a, b) => {
                        let t = ((p - low) / (high - low)).element_sum() / 2.0;
                        light.matt(a.lerp(*b, t), Vec3::NEG_Z, ray)
                    }
                };
                (color, 1.0)
            });
        }
    }
}

/// Row-major pixels whose centre some parts cover.
pub(crate) fn covered_by(parts: &[Part], frame: &Frame) -> Vec<usize> {
    let mut pixels = Vec::new();
    for part in parts {
        let (columns, rows) = frame.window(part.figure.bounds());
        for row in rows {
            let at = |column: usize| row * frame.width + column;
            pixels.extend(
                columns
                    .clone()
                    .map(at)
                    .filter(|&pixel| part.figure.distance(frame.centre(pixel)) < 0.0),
            );
        }
    }
    pixels.sort_unstable();
    pixels.dedup();
    pixels
}
