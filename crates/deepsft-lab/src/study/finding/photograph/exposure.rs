//! What a camera makes of light: lens, exposure and grain. And the noise and colours of what stands before it.

use crate::study::finding::dice::{Dice, uniform};
use deepsft_geometry::Picture;
use deepsft_geometry::glam::{Vec2, Vec3};
use deepsft_synth::painting::{ValueNoise, srgb8_from_linear};
use rand::RngExt;

/// Points on the disc that a point out of focus becomes.
const DISC_POINTS: usize = 28;

/// The golden angle spreads them evenly.
const GOLDEN_ANGLE: f32 = 2.399_963;

/// What the camera sees: linear light, and how far away it is in units of the distance that is in focus.
pub struct Exposure {
    pub width: usize,
    pub height: usize,
    pub light: Vec<Vec3>,
    distance: Vec<f32>,
}

impl Exposure {
    pub fn black(width: usize, height: usize) -> Self {
        Self {
            width,
            height,
            light: vec![Vec3::ZERO; width * height],
            distance: vec![1.0; width * height],
        }
    }

    pub fn size(&self) -> Vec2 {
        Vec2::new(self.width as f32, self.height as f32)
    }

    pub fn set(&mut self, column: usize, row: usize, light: Vec3, distance: f32) {
        let pixel = row * self.width + column;
        self.light[pixel] = light;
        self.distance[pixel] = distance;
    }

    /// The picture that comes out of the camera: lens, exposure, film.
    pub fn developed(self, dice: &mut Dice) -> Picture {
        let aperture = uniform(dice, 0.0, 9.0) * uniform(dice, 0.0, 1.0);
        let (light, size) = (self.out_of_focus(aperture), self.size());
        let mean = light.iter().map(|c| c.element_sum() / 3.0).sum::<f32>() / light.len() as f32;
        let exposure = uniform(dice, 0.3, 0.6) / mean.max(1e-3);
        let balance = Vec3::new(uniform(dice, 0.85, 1.15), 1.0, uniform(dice, 0.85, 1.15));
        let (vignette, grain) = (uniform(dice, 0.0, 0.5), uniform(dice, 0.005, 0.04));
        let colorful = if dice.random_bool(0.12) {
            0.0
        } else {
            uniform(dice, 0.7, 1.15)
        };
        Picture::from_fn(self.width, self.height, |x, y| {
            let from_middle = (Vec2::new(x as f32, y as f32) / size - 0.5) * 2.0;
            let fall = 1.0 - vignette * 0.5 * from_middle.length_squared();
            let c = light[y * self.width + x] * exposure * balance * fall;
            let grey = Vec3::splat(c.dot(Vec3::new(0.21, 0.72, 0.07)));
            let c = grey.lerp(c, colorful).max(Vec3::ZERO);
            // A shoulder keeps what is bright from being cut off.
            let c = c * (1.0 + c / 6.0) / (1.0 + c);
            let speck = (0..3).map(|_| dice.random::<f32>()).sum::<f32>() * 2.0 - 3.0;
            srgb8_from_linear(c + speck * grain * (c + 0.02).map(f32::sqrt) * 0.5)
        })
    }

    /// Each pixel as the mean over a disc that grows with its distance from what is in focus; nothing sharp bleeds into it.
    fn out_of_focus(&self, aperture: f32) -> Vec<Vec3> {
        let radius = |pixel: usize| (aperture * (1.0 / self.distance[pixel].max(0.1) - 1.0).abs()).min(9.0);
        let disc: Vec<Vec2> = (0..DISC_POINTS)
            .map(|k| Vec2::from_angle(k as f32 * GOLDEN_ANGLE) * ((k as f32 + 0.5) / DISC_POINTS as f32).sqrt())
            .collect();
        let at = |x: f32, y: f32| {
            let column = (x.max(0.0) as usize).min(self.width - 1);
            (y.max(0.0) as usize).min(self.height - 1) * self.width + column
        };
        let blurred = |pixel: usize| {
            let own = radius(pixel);
            if own < 0.5 {
                return self.light[pixel];
            }
            let (x, y) = ((pixel % self.width) as f32 + 0.5, (pixel / self.width) as f32 + 0.5);
            let (mut sum, mut weight) = (self.light[pixel], 1.0);
            for offset in &disc {
                let other = at(x + own * offset.x, y + own * offset.y);
                if radius(other) + 0.5 > own * offset.length() {
                    sum += self.light[other];
                    weight += 1.0;
                }
            }
            sum / weight
        };
        (0..self.light.len()).map(blurred).collect()
    }
}

/// Noise in space: the sum of plane noise over the three coordinate planes.
#[derive(Clone, Copy)]
pub struct SolidNoise([ValueNoise; 3]);

impl SolidNoise {
    pub fn new(dice: &mut Dice) -> Self {
        Self(std::array::from_fn(|_| ValueNoise::new(dice)))
    }

    /// About -1 to 1.
    pub fn fractal(&self, p: Vec3, octaves: usize) -> f32 {
        let [a, b, c] = &self.0;
        let sum = a.fractal(Vec2::new(p.x, p.y), octaves)
            + b.fractal(Vec2::new(p.y, p.z) + 31.7, octaves)
            + c.fractal(Vec2::new(p.z, p.x) + 57.3, octaves);
        sum * 0.6
    }
}

/// A colour in linear light: not too pure, as things outside are.
pub fn natural_color(dice: &mut Dice, brightness: [f32; 2]) -> Vec3 {
    let grey = uniform(dice, brightness[0], brightness[1]);
    let (warm, green) = (uniform(dice, -0.1, 0.35), uniform(dice, -0.1, 0.15));
    let tint = Vec3::new(1.0 + warm, 1.0 + green, 1.0 - warm);
    Vec3::splat(grey) * tint
}

/// 0 below `low`, 1 above `high`, smooth between.
pub fn smooth_step(low: f32, high: f32, x: f32) -> f32 {
    let t = ((x - low) / (high - low)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

/// A number in 0 to 1 of a cell of the plane.
pub fn of_cell(p: Vec2, salt: u32) -> f32 {
    let (i, j) = (p.x.floor() as i32 as u32, p.y.floor() as i32 as u32);
    let mixed = deepsft_synth::random::mix(u64::from(i) << 32 | u64::from(j) ^ (u64::from(salt) << 17));
    (mixed >> 40) as f32 / (1_u64 << 24) as f32
}
