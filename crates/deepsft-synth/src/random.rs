//! Seeded randomness: one generator per purpose, and the draws that all random models share.

use deepsft_geometry::glam::{DVec2, DVec3, Vec2};
use rand::{Rng, RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;

/// What a random stream is for. Every purpose has its own stream, so that drawing more numbers for one leaves
/// the others as they were.
#[derive(Clone, Copy, Debug)]
pub enum Stream {
    /// What is around the template: background, light, occluders, camera.
    Scene,
    /// Its shape and pose.
    Shape,
    /// The shapes that samples draw from.
    Pool,
    /// How it moves in a clip.
    Motion,
    /// Disturbances of known size, for measurements.
    Disturbance,
    /// An RGB-D recording.
    Recording,
    /// The noise of a depth camera.
    DepthNoise,
}

/// The generator of a purpose within sample `index` of the data set `seed`.
pub fn generator(seed: u64, index: u64, stream: Stream) -> Pcg64Mcg {
    let mixed = mix(mix(mix(seed) ^ index) ^ stream as u64);
    Pcg64Mcg::seed_from_u64(mixed)
}

/// The finaliser of SplitMix64 (Steele, Lea and Flood 2014): a bijection of 64 bits without visible order.
pub fn mix(value: u64) -> u64 {
    let z = value.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

/// A uniform number of the range [low, high] in single precision, for what is painted.
pub(crate) fn uniform<R: Rng + ?Sized>(rng: &mut R, range: [f64; 2]) -> f32 {
    between(range, rng) as f32
}

/// What `draw` draws with the given probability, else `otherwise`.
pub(crate) fn draw_or<R: Rng + ?Sized, T>(
    rng: &mut R,
    probability: f64,
    otherwise: T,
    draw: impl FnOnce(&mut R) -> T,
) -> T {
    if rng.random_bool(probability) {
        draw(rng)
    } else {
        otherwise
    }
}

/// A uniform unit vector of the image plane.
pub(crate) fn unit_vector<R: Rng + ?Sized>(rng: &mut R) -> Vec2 {
    Vec2::from_angle(rng.random_range(0.0..std::f32::consts::TAU))
}

/// A uniform unit vector of space: height and longitude of the sphere are uniform (Archimedes).
pub(crate) fn unit_direction<R: Rng + ?Sized>(rng: &mut R) -> DVec3 {
    let height: f64 = between([-1.0, 1.0], rng);
    let around = DVec2::from_angle(between([0.0, std::f64::consts::TAU], rng));
    (around * (1.0 - height * height).max(0.0).sqrt()).extend(height)
}

/// A number drawn uniformly between the two ends.
pub fn between<R: Rng + ?Sized>([low, high]: [f64; 2], rng: &mut R) -> f64 {
    low + (high - low) * rng.random::<f64>()
}

/// True with the given probability.
pub(crate) fn chance<R: Rng + ?Sized>(probability: f64, rng: &mut R) -> bool {
    rng.random::<f64>() < probability
}

/// -1 or 1, equally often.
pub fn sign<R: Rng + ?Sized>(rng: &mut R) -> f64 {
    if chance(0.5, rng) { -1.0 } else { 1.0 }
}
