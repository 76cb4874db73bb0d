//! Printed cloth: colours as functions of the place on the cloth. Nothing repeats itself exactly, so that every place
//! can be told from every other.

use deepsft_geometry::glam::{Vec2, Vec3};
use deepsft_synth::painting::{ValueNoise, floor};
use deepsft_synth::random::mix;
use rand::SeedableRng;
use rand_pcg::Pcg64Mcg;
use std::f32::consts::TAU;

/// Side of a patch of patchwork, mm.
const PATCH_MM: f32 = 19.0;

/// What is printed on a cloth. Lengths in mm, colours in sRGB 0 to 1.
#[derive(Clone, Debug)]
pub(crate) enum Print {
    /// Nothing but the pile.
    Plush { color: Vec3 },
    /// Discs of all sizes.
    Dots { ground: Vec3, inks: Vec<Vec3>, pitch: f32 },
    /// Stripes of all widths across the cloth.
    Stripes { inks: Vec<Vec3>, pitch: f32, angle: f32 },
    /// Stripes both ways.
    Plaid { inks: Vec<Vec3>, pitch: f32 },
    /// Flowers of `petals` petals; five long thin ones make a star.
    Flowers {
        ground: Vec3,
        inks: Vec<Vec3>,
        pitch: f32,
        petals: f32,
        depth: f32,
    },
    /// Patches of the other prints.
    Patchwork { prints: Vec<Print> },
}

/// A cloth with its print.
#[derive(Clone, Debug)]
pub(crate) struct Fabric {
    print: Print,
    seed: u64,
    pile: ValueNoise,
    shade: ValueNoise,
}

impl Fabric {
    /// A cloth whose accidents follow from `seed`.
    pub(crate) fn new(print: Print, seed: u64) -> Self {
        let mut rng = Pcg64Mcg::seed_from_u64(seed);
        Self {
            pile: ValueNoise::new(&mut rng),
            shade: ValueNoise::new(&mut rng),
            print,
            seed,
        }
    }

    /// Colour (sRGB) at place `p`, mm.
    pub(crate) fn color(&self, p: Vec2) -> Vec3 {
        // Threads are never quite straight.
        let wobble = Vec2::new(self.shade.at(p / 9.0 + 40.0), self.shade.at(p / 9.0 - 70.0)) * 0.7;
        let ink = printed(&self.print, p + wobble, self.seed);
        let plush = matches!(self.print, Print::Plush { .. });
        let (fur, depth) = if plush { (0.16, 0.08) } else { (0.07, 0.05) };
        // Tufts that lie down the cloth, fine pile, and cloth that has been played with.
        let tufts = self.pile.at(Vec2::new(p.x / 1.3, p.y / 4.5)) * fur + self.pile.at(p / 0.7 + 11.0) * 0.6 * fur;
        let worn = self.shade.at(p / 14.0) * depth + self.shade.at(p / 38.0 + 5.0) * depth;
        (ink * (1.0 + tufts + worn)).clamp(Vec3::ZERO, Vec3::ONE)
    }
}

/// A random number in 0..1 of a cell and a purpose.
fn random(cell: Vec2, seed: u64, purpose: u64) -> f32 {
    let (i, j) = (cell.x as i32 as u32, cell.y as i32 as u32);
    let hash = mix(mix(seed ^ (purpose << 40)) ^ (u64::from(i) << 32 | u64::from(j)));
    (hash >> 40) as f32 / (1_u64 << 24) as f32
}

fn pick(inks: &[Vec3], random: f32) -> Vec3 {
    inks.get((random * inks.len() as f32) as usize)
        .copied()
        .unwrap_or(Vec3::ONE)
}

fn printed(print: &Print, p: Vec2, seed: u64) -> Vec3 {
    match print {
        Print::Plush { color } => *color,
        Print::Dots { ground, inks, pitch } => {
            motif(p, *pitch, *ground, inks, seed, |offset, _, size| offset.length() < size)
        }
        Print::Flowers {
            ground,
            inks,
            pitch,
            petals,
            depth,
        } => {
            let flower = |offset: Vec2, turn: f32, size: f32| {
                let wave = (petals * (offset.to_angle() + turn * TAU)).cos();
                offset.length() < size * (1.0 - depth * (0.5 - 0.5 * wave))
            };
            let blossom = motif(p, *pitch, *ground, inks, seed, flower);
            // A heart of another colour.
            let paler = Vec3::new(1.0, 0.93, 0.7);
            motif(p, *pitch, blossom, &[paler], seed, |offset, _, size| {
                offset.length() < 0.3 * size
            })
        }
        Print::Stripes { inks, pitch, angle } => stripe(Vec2::from_angle(*angle).dot(p), *pitch, inks, seed),
        Print::Plaid { inks, pitch } => {
            let (across, down) = (stripe(p.x, *pitch, inks, seed), stripe(p.y, *pitch, inks, mix(seed)));
            across.lerp(down, 0.5)
        }
        Print::Patchwork { prints } => patchwork(prints, p, seed),
    }
}

/// Colour of the figure nearest above `p`: one a cell of a jittered grid, of random size and ink.
fn motif(p: Vec2, pitch: f32, ground: Vec3, inks: &[Vec3], seed: u64, covers: impl Fn(Vec2, f32, f32) -> bool) -> Vec3 {
    let cell = floor(p / pitch);
    let mut color = ground;
    for row in -1..=1 {
        for column in -1..=1 {
            let cell = cell + Vec2::new(column as f32, row as f32);
            let r = |purpose| random(cell, seed, purpose);
            let centre = (cell + Vec2::new(0.2 + 0.6 * r(1), 0.2 + 0.6 * r(2))) * pitch;
            let size = pitch * (0.2 + 0.32 * r(3));
            if covers(p - centre, r(4), size) {
                color = pick(inks, r(5));
            }
        }
    }
    color
}

/// Colour of a stripe at `t`: bands of one to three parts of the pitch, each with an ink of its own and thin lines.
fn stripe(t: f32, pitch: f32, inks: &[Vec3], seed: u64) -> Vec3 {
    let band = (t / pitch).floor();
    let fraction = t / pitch - band;
    let split = 0.25 + 0.5 * random(Vec2::new(band, 0.0), seed, 6);
    let half = 2.0 * band + f32::from(u8::from(fraction > split));
    let ink = pick(inks, random(Vec2::new(half, 1.0), seed, 7));
    let line = random(Vec2::new(band, 2.0), seed, 8);
    if (fraction - line).abs() * pitch < 0.35 {
        ink * 0.55
    } else {
        ink
    }
}

fn patchwork(prints: &[Print], p: Vec2, seed: u64) -> Vec3 {
    let row = (p.y / PATCH_MM).floor();
    // Rows are shifted against each other like bricks.
    let shift = random(Vec2::new(0.0, row), seed, 9);
    let across = p.x / PATCH_MM + shift;
    let cell = Vec2::new(across.floor(), row);
    let inside = Vec2::new(across - cell.x, p.y / PATCH_MM - row);
    let number = (random(cell, seed, 10) * prints.len() as f32) as usize;
    let turned = Vec2::from_angle(TAU * random(cell, seed, 11)).rotate(p);
    let own = mix(seed ^ number as u64) ^ (random(cell, seed, 12) * 1e6) as u64;
    let color = prints
        .get(number)
        .map_or(Vec3::ONE, |print| printed(print, turned, own));
    let edge = inside.min(1.0 - inside).min_element() * PATCH_MM;
    // The seam between two patches, and a row of stitches beside it.
    let along = if (0.5 - (inside.x - 0.5).abs()) < (0.5 - (inside.y - 0.5).abs()) {
        p.y
    } else {
        p.x
    };
    if edge < 0.5 {
        color * 0.45
    } else if (1.2..1.9).contains(&edge) && (along / 2.6).fract().abs() < 0.6 {
        Vec3::new(0.98, 0.95, 0.86)
    } else {
        color
    }
}
