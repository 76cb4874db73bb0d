//! Seeded randomness: one generator a purpose, ranges, and smooth value noise.

use crate::sampling::between;
use deepsft_geometry::glam::{DVec2, DVec3, Vec2, Vec3};
use rand::{Rng, RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;

/// What a random stream is for. Every purpose has its own stream, so that drawing more numbers for one leaves
/// the others as they were.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Stream {
    Scene,
    Shape,
    Pool,
    Motion,
    Disturbance,
    Recording,
    DepthNoise,
}

/// The generator of a purpose within sample `index` of the data set `seed`.
pub(crate) fn generator(seed: u64, index: u64, stream: Stream) -> Pcg64Mcg {
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

/// A uniform colour of the cube, squared towards darker light as most things are.
pub(crate) fn any_color<R: Rng + ?Sized>(rng: &mut R) -> Vec3 {
    let color = Vec3::from_array(rng.random());
    color * color
}

/// A colour of the given `saturation` (0 grey, 1 pure) and `value` at a random hue, in linear light.
pub(crate) fn vivid_color<R: Rng + ?Sized>(rng: &mut R, saturation: f32, value: f32) -> Vec3 {
    let hue = rng.random_range(0.0..3.0_f32);
    let wave = |k: f32| (1.5 - (hue - k).abs().min(3.0 - (hue - k).abs()) * 1.5).clamp(0.0, 1.0);
    let pure = Vec3::new(wave(0.0), wave(1.0), wave(2.0));
    Vec3::ONE.lerp(pure, saturation) * value
}

/// The largest whole numbers not above, for coordinates within 2^31 (the standard function is a call on plain x86-64).
pub fn floor(p: Vec2) -> Vec2 {
    let below = |x: f32| {
        let whole = x as i32 as f32;
        if whole > x { whole - 1.0 } else { whole }
    };
    Vec2::new(below(p.x), below(p.y))
}

/// Smooth noise in -1 to 1 with features of about one unit (value noise, cubic interpolation).
#[derive(Clone, Copy, Debug)]
pub struct ValueNoise {
    seed: u32,
}

impl ValueNoise {
    /// A noise of its own for each draw of the generator.
    pub fn new<R: Rng + ?Sized>(rng: &mut R) -> Self {
        Self { seed: rng.random() }
    }

    /// Its value at a point.
    pub fn at(&self, p: Vec2) -> f32 {
        let cell = floor(p);
        let t = p - cell;
        let t = t * t * (3.0 - 2.0 * t);
        let (i, j) = (cell.x as i32 as u32, cell.y as i32 as u32);
        let lattice = |i: u32, j: u32| {
            let mut hash = i.wrapping_mul(0x9e37_79b1) ^ j.wrapping_mul(0x85eb_ca77) ^ self.seed;
            hash = (hash ^ (hash >> 15)).wrapping_mul(0x2c1b_3c6d);
            hash = (hash ^ (hash >> 12)).wrapping_mul(0x297a_2d39);
            (hash >> 8) as f32 / (1 << 23) as f32 - 1.0
        };
        let (right, below) = (i.wrapping_add(1), j.wrapping_add(1));
        let top = lattice(i, j) + (lattice(right, j) - lattice(i, j)) * t.x;
        let bottom = lattice(i, below) + (lattice(right, below) - lattice(i, below)) * t.x;
        top + (bottom - top) * t.y
    }

    /// Sum of `octaves` of the noise, each half the size and half the height of the one before; about -1 to 1.
    pub fn fractal(&self, p: Vec2, octaves: usize) -> f32 {
        let (mut sum, mut p, mut height) = (0.0, p, 0.6);
        for _ in 0..octaves {
            sum += height * self.at(p);
            p = p * 2.0 + 17.3;
            height *= 0.5;
        }
        sum
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn streams_of_neighbouring_samples_differ() {
        let draw = |seed, index, stream| generator(seed, index, stream).random::<u64>();
        assert_eq!(draw(1, 2, Stream::Scene), draw(1, 2, Stream::Scene));
        let all = [
            draw(1, 2, Stream::Scene),
            draw(1, 3, Stream::Scene),
            draw(2, 2, Stream::Scene),
            draw(2, 1, Stream::Scene),
            draw(1, 2, Stream::Shape),
        ];
        assert!((0..all.len()).all(|i| (0..i).all(|j| all[i] != all[j])));
    }

    #[test]
    fn value_noise_is_smooth_and_fills_its_range() {
        let noise = ValueNoise { seed: 5 };
        let values: Vec<f32> = (0..20_000)
            .map(|i| noise.at(Vec2::new(i as f32 * 0.01, i as f32 * 0.003)))
            .collect();
        assert!(values.iter().all(|v| v.abs() <= 1.0));
        assert!(values.iter().any(|&v| v > 0.7) && values.iter().any(|&v| v < -0.7));
        // Slope of value noise: at most 1.5 * 2 a unit along each axis.
        assert!(values.windows(2).all(|v| (v[1] - v[0]).abs() < 3.0 * 0.0131));
    }
}
