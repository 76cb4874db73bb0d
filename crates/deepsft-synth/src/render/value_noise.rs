//! Smooth value noise, for all that is painted.

use deepsft_geometry::glam::Vec2;
use rand::{Rng, RngExt};

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

    /// Sums `octaves` of the noise, each half the size and half the height of the one before. The sum is about -1 to 1.
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
