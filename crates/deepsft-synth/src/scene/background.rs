//! Backgrounds: procedural rooms, surfaces and clutter, and the user's photographs. Every sample places its background
//! differently.

use crate::random::{Stream, draw_or, generator, uniform, unit_vector};
use crate::render::{Figure, Frame, Texture, ValueNoise, any_color, floor, vivid_color};
use crate::scene::artwork::artwork;
use deepsft_geometry::glam::{Mat3, Vec2, Vec3};
use rand::{Rng, RngExt};
use std::f32::consts::TAU;
use std::sync::{Arc, OnceLock};

/// Size of a procedural background, pixels.
const SIDE: Vec2 = Vec2::new(640.0, 400.0);

const BACKGROUNDS: usize = 48;

const ARTWORKS: usize = 40;

/// Seed of the procedural pictures, the same for every data set. A sample's own seed decides which picture it uses, and
/// how.
const POOL_SEED: u64 = 0x5f7d_ee95;

static BACKGROUND_POOL: [OnceLock<Arc<Texture>>; BACKGROUNDS] = [const { OnceLock::new() }; BACKGROUNDS];

static ARTWORK_POOL: [OnceLock<Arc<Texture>>; ARTWORKS] = [const { OnceLock::new() }; ARTWORKS];

/// One of the procedural backgrounds, shared by the whole process. Each is painted when it is first asked for.
pub(crate) fn any_background<R: Rng + ?Sized>(rng: &mut R) -> Arc<Texture> {
    background(rng.random_range(0..BACKGROUNDS))
}

/// One of the procedural printed sheets, likewise.
pub(crate) fn any_artwork<R: Rng + ?Sized>(rng: &mut R) -> Arc<Texture> {
    printed_artwork(rng.random_range(0..ARTWORKS))
}

fn background(number: usize) -> Arc<Texture> {
    let painters: [fn(&mut Frame, &mut _); 8] = [room, surface, clutter, planks, leaves, pattern, gallery, gradient];
    let paint = || {
        let mut rng = generator(POOL_SEED, number as u64, Stream::Pool);
        let mut frame = Frame::filled(SIDE.x as usize, SIDE.y as usize, any_color(&mut rng));
        painters[number % painters.len()](&mut frame, &mut rng);
        Arc::new(Texture::new(&frame.to_picture()))
    };
    BACKGROUND_POOL[number].get_or_init(paint).clone()
}

fn printed_artwork(number: usize) -> Arc<Texture> {
    let paint = || {
        let mut rng = generator(POOL_SEED, (BACKGROUNDS + number) as u64, Stream::Pool);
        Arc::new(Texture::new(&artwork(number, &mut rng).1))
    };
    ARTWORK_POOL[number].get_or_init(paint).clone()
}

/// How a background picture is laid into the frame: crop, zoom, rotation, reflection, colour.
pub(crate) struct Placement {
    /// Picture texels from frame pixels: texel = origin + right * x + down * y.
    origin: Vec2,
    right: Vec2,
    down: Vec2,
    color: Mat3,
    offset: Vec3,
}

impl Placement {
    /// Draws a placement of `texture` in a frame of `frame_side` pixels.
    pub(crate) fn sample<R: Rng + ?Sized>(texture: &Texture, frame_side: Vec2, rng: &mut R) -> Self {
        // Zoom 1 shows as much of the picture as the frame can hold. A higher zoom shows it larger.
        let zoom = uniform(rng, [0.8, 1.0]) * 2.0_f32.powf(uniform(rng, [0.0, 1.8]));
        let texels = (texture.size() / frame_side).min_element() / zoom;
        let most = if rng.random_bool(0.6) { 0.25 } else { 3.1 };
        let right = Vec2::from_angle(uniform(rng, [-most, most])) * texels;
        let down = right.perp() * if rng.random_bool(0.5) { 1.0 } else { -1.0 };
        let centre = texture.size() * Vec2::new(uniform(rng, [0.2, 0.8]), uniform(rng, [0.2, 0.8]));
        let origin = centre - (right * frame_side.x + down * frame_side.y) / 2.0;
        let (color, offset) = color_jitter(rng);
        Self {
            origin,
            right,
            down,
            color,
            offset,
        }
    }

    /// The middle of `texture` unchanged, just large enough to fill a frame of `frame_side` pixels.
    pub(crate) fn filling(texture: &Texture, frame_side: Vec2) -> Self {
        let texels = (texture.size() / frame_side).min_element();
        Self {
            origin: (texture.size() - frame_side * texels) / 2.0,
            right: Vec2::X * texels,
            down: Vec2::Y * texels,
            color: Mat3::IDENTITY,
            offset: Vec3::ZERO,
        }
    }

    /// Draws `texture` at this place into a frame of the given size. Beyond its edges the texture is mirrored.
    pub(crate) fn frame(&self, texture: &Texture, width: usize, height: usize) -> Frame {
        let mut frame = Frame::filled(width, height, Vec3::ZERO);
        let size = texture.size();
        let footprint = self.right.length();
        for row in 0..height {
            for column in 0..width {
                let texel = self.origin + self.right * (column as f32 + 0.5) + self.down * (row as f32 + 0.5);
                let light = texture.trilinear(mirrored(texel / size), footprint);
                frame.set(row * width + column, (self.color * light + self.offset).max(Vec3::ZERO));
            }
        }
        frame
    }
}

/// Reflects coordinates back into the unit square: from 0 to 1 and back to 0.
fn mirrored(uv: Vec2) -> Vec2 {
    Vec2::ONE - (uv - 2.0 * floor(uv / 2.0) - 1.0).abs()
}

/// A random change of exposure, tint and saturation, as a matrix and an offset on linear light. It seldom exchanges red,
/// green and blue.
pub(crate) fn color_jitter<R: Rng + ?Sized>(rng: &mut R) -> (Mat3, Vec3) {
    let level = 2.0_f32.powf(uniform(rng, [-1.6, 0.7]));
    let gains = Vec3::new(uniform(rng, [0.8, 1.2]), 1.0, uniform(rng, [0.8, 1.2])) * level;
    let saturation = uniform(rng, [0.2, 1.3]);
    let grey = Mat3::from_cols(Vec3::splat(0.3), Vec3::splat(0.59), Vec3::splat(0.11));
    let turn = draw_or(rng, 0.3, 0, |rng| rng.random_range(0..3));
    let columns = [Vec3::X, Vec3::Y, Vec3::Z];
    let exchange = Mat3::from_cols(columns[turn % 3], columns[(turn + 1) % 3], columns[(turn + 2) % 3]);
    let color = Mat3::from_diagonal(gains) * (exchange * saturation + grey * (1.0 - saturation));
    (color, Vec3::splat(uniform(rng, [0.0, 0.04])))
}

/// Lays some things over a finished background, so that no two samples share one.
pub(crate) fn strew<R: Rng + ?Sized>(frame: &mut Frame, rng: &mut R) {
    if rng.random_bool(0.4) {
        for _ in 0..rng.random_range(1..30) {
            thing(frame, [3.0, 90.0], rng);
        }
    }
}

fn anywhere<R: Rng + ?Sized>(frame: &Frame, rng: &mut R) -> Vec2 {
    Vec2::new(
        frame.width as f32 * rng.random::<f32>(),
        frame.height as f32 * rng.random::<f32>(),
    )
}

/// A quiet colour, like that of walls, floors and furniture.
fn quiet_color<R: Rng + ?Sized>(rng: &mut R) -> Vec3 {
    let (saturation, value) = (uniform(rng, [0.0, 0.45]), uniform(rng, [0.05, 0.9]));
    vivid_color(rng, saturation, value)
}

/// A wall and a floor with windows, pictures and box-like furniture.
fn room<R: Rng + ?Sized>(frame: &mut Frame, rng: &mut R) {
    let horizon = SIDE.y * uniform(rng, [0.45, 0.85]);
    let (wall, floor) = (quiet_color(rng), quiet_color(rng) * 0.7);
    let light_side = uniform(rng, [-0.5, 0.5]);
    let plaster = ValueNoise::new(rng);
    frame.map(|p, _| {
        let falloff = 1.0 + light_side * (p.x / SIDE.x - 0.5);
        let grain = 1.0 + 0.05 * plaster.fractal(p * 0.08, 3);
        if p.y < horizon {
            wall * falloff * grain
        } else {
            floor * falloff * (0.6 + 0.4 * (p.y - horizon) / (SIDE.y - horizon))
        }
    });
    let skirting = Figure::upright(Vec2::new(0.0, horizon - 5.0), Vec2::new(SIDE.x, horizon));
    frame.fill(&skirting, wall * 0.5);
    for _ in 0..rng.random_range(1..5) {
        let corner = anywhere(frame, rng) * Vec2::new(0.9, 0.5);
        let size = Vec2::new(uniform(rng, [40.0, 180.0]), uniform(rng, [40.0, 160.0]));
        let rim = quiet_color(rng);
        frame.fill(&Figure::upright(corner - 5.0, corner + size + 5.0), rim);
        if rng.random_bool(0.4) {
            hang(frame, &any_artwork(rng), corner, size, Vec2::X);
            continue;
        }
        let a = any_color(rng);
        let white = rng.random_bool(0.4);
        let b = if white { Vec3::splat(0.95) } else { any_color(rng) };
        frame.paint(&Figure::upright(corner, corner + size), |p| {
            (a.lerp(b, ((p - corner) / size).element_sum() / 2.0), 1.0)
        });
        for bar in 1..rng.random_range(1..4) {
            let x = corner.x + size.x * bar as f32 / 3.0;
            let bar = Figure::upright(Vec2::new(x - 2.0, corner.y), Vec2::new(x + 2.0, corner.y + size.y));
            frame.fill(&bar, rim);
        }
    }
    for _ in 0..rng.random_range(2..8) {
        furniture(frame, horizon, rng);
    }
}

/// A box standing on the floor: front, top, and shelves or drawers.
fn furniture<R: Rng + ?Sized>(frame: &mut Frame, horizon: f32, rng: &mut R) {
    let size = Vec2::new(uniform(rng, [30.0, 200.0]), uniform(rng, [30.0, 220.0]));
    let foot = horizon + (SIDE.y - horizon) * uniform(rng, [0.05, 0.9]);
    let low = Vec2::new(uniform(rng, [-40.0, 620.0]), foot - size.y);
    let color = quiet_color(rng);
    let depth = Vec2::new(uniform(rng, [-25.0, 25.0]), -uniform(rng, [5.0, 20.0]));
    let (right, bottom) = (Vec2::new(size.x, 0.0), Vec2::new(0.0, size.y));
    let top = Figure::Polygon(vec![low, low + depth, low + right + depth, low + right]);
    frame.fill(&top, color * 1.3);
    let near = if depth.x > 0.0 { low + right } else { low };
    let side = Figure::Polygon(vec![near, near + depth, near + depth + bottom, near + bottom]);
    frame.fill(&side, color * 0.5);
    frame.fill(&Figure::upright(low, low + size), color);
    let shelves = rng.random_range(0..5);
    for shelf in 0..shelves {
        let y = low.y + size.y * (shelf as f32 + 0.1) / shelves as f32;
        let height = size.y * 0.8 / shelves as f32;
        let inner = color * uniform(rng, [0.3, 0.9]);
        let opening = Figure::upright(Vec2::new(low.x + 4.0, y), Vec2::new(low.x + size.x - 4.0, y + height));
        frame.fill(&opening, inner);
        let mut x = low.x + 6.0;
        while x < low.x + size.x - 16.0 && inner.x < color.x * 0.6 {
            let book = Vec2::new(uniform(rng, [4.0, 14.0]), height * uniform(rng, [0.5, 0.95]));
            let spine = Figure::upright(Vec2::new(x, y + height - book.y), Vec2::new(x + book.x, y + height));
            frame.fill(&spine, any_color(rng));
            x += book.x + 1.0;
        }
    }
}

/// A grained surface: plaster, cloth, stone, carpet.
fn surface<R: Rng + ?Sized>(frame: &mut Frame, rng: &mut R) {
    let (a, b) = (quiet_color(rng), quiet_color(rng));
    let (coarse, fine) = (ValueNoise::new(rng), ValueNoise::new(rng));
    let scale = Vec2::new(uniform(rng, [0.005, 0.1]), uniform(rng, [0.005, 0.1]));
    let grain = uniform(rng, [0.0, 0.5]);
    let octaves = rng.random_range(2..7);
    let weave = draw_or(rng, 0.4, 0.0, |rng| uniform(rng, [0.4, 2.5]));
    frame.map(|p, _| {
        let t = (0.5 + 0.8 * coarse.fractal(p * scale, octaves)).clamp(0.0, 1.0);
        // Without a weave both sines are zero.
        let threads = 1.0 + 0.25 * (p.x * weave).sin() * (p.y * weave).sin();
        a.lerp(b, t) * (1.0 + grain * fine.at(p * 0.9)) * threads
    });
}

/// Boards of wood.
fn planks<R: Rng + ?Sized>(frame: &mut Frame, rng: &mut R) {
    let red = uniform(rng, [0.15, 0.7]);
    let wood = Vec3::new(red, red * uniform(rng, [0.45, 0.8]), red * uniform(rng, [0.15, 0.6]));
    let grain = ValueNoise::new(rng);
    let board = uniform(rng, [30.0, 220.0]);
    let lines = uniform(rng, [0.06, 0.35]);
    let contrast = uniform(rng, [0.1, 0.6]);
    frame.map(|p, _| {
        let number = (p.y / board).floor();
        let at = Vec2::new(p.x * 0.006 + number * 37.0, p.y * lines);
        let rings = grain.fractal(at + 0.8 * grain.at(at * 0.3), 4);
        let tone = 1.0 + 0.25 * grain.at(Vec2::new(number * 3.7, 9.0)) + contrast * rings;
        let joint = if (p.y - number * board) < 2.0 { 0.4 } else { 1.0 };
        wood * (tone * joint).max(0.02)
    });
    for _ in 0..rng.random_range(0..6) {
        thing(frame, [6.0, 140.0], rng);
    }
}

/// Large and medium things on top of each other.
fn clutter<R: Rng + ?Sized>(frame: &mut Frame, rng: &mut R) {
    for _ in 0..rng.random_range(40..140) {
        thing(frame, [6.0, 140.0], rng);
    }
}

/// Things of all sizes, most of them small. Such "dead leaves" have the statistics of natural pictures.
fn leaves<R: Rng + ?Sized>(frame: &mut Frame, rng: &mut R) {
    clutter(frame, rng);
    for _ in 0..rng.random_range(500..2000) {
        // A density of size^-3 between 2 and 60 pixels.
        let size = 2.0 / (1.0 - f64::from(rng.random::<f32>()) * 0.9989).sqrt();
        thing(frame, [size, size], rng);
    }
}

/// Printed sheets close together: a wall of posters, a table of magazines.
fn gallery<R: Rng + ?Sized>(frame: &mut Frame, rng: &mut R) {
    surface(frame, rng);
    let upright = rng.random_bool(0.5);
    for _ in 0..rng.random_range(4..12) {
        let size = Vec2::new(uniform(rng, [90.0, 260.0]), uniform(rng, [90.0, 220.0]));
        let axis = if upright { Vec2::X } else { unit_vector(rng) };
        let corner = anywhere(frame, rng) - (axis * size.x + axis.perp() * size.y) / 2.0;
        hang(frame, &any_artwork(rng), corner, size, axis);
    }
}

/// Paints a picture with its first pixel at `corner`, its rows along the unit vector `axis`, `size` pixels large.
fn hang(frame: &mut Frame, texture: &Texture, corner: Vec2, size: Vec2, axis: Vec2) {
    let half = size / 2.0;
    let centre = corner + axis * half.x + axis.perp() * half.y;
    let footprint = (texture.size() / size).max_element();
    frame.paint(&Figure::Rectangle(centre, axis, half), |p| {
        let offset = p - corner;
        let uv = Vec2::new(offset.dot(axis), offset.dot(axis.perp())) / size;
        (texture.trilinear(uv, footprint), 1.0)
    });
}

/// A random polygon, ellipse, box or stroke with a shade across it, or a line of marks like text. The logarithm of its
/// size in pixels is uniform.
fn thing<R: Rng + ?Sized>(frame: &mut Frame, [smallest, largest]: [f64; 2], rng: &mut R) {
    let centre = anywhere(frame, rng);
    let size = smallest as f32 * 2.0_f32.powf(uniform(rng, [0.0, (largest / smallest).log2()]));
    let axis = unit_vector(rng);
    let shape = match rng.random_range(0..5) {
        0 => Figure::Ellipse(centre, axis, Vec2::new(size, size * uniform(rng, [0.2, 1.0]))),
        1 => Figure::Rectangle(centre, axis, Vec2::new(size, size * uniform(rng, [0.1, 1.0]))),
        2 => {
            let corners = rng.random_range(3..8);
            let start = uniform(rng, [0.0, 6.0]);
            let direction = |k: usize| Vec2::from_angle(start + k as f32 * TAU / corners as f32);
            let outline = (0..corners).map(|k| centre + direction(k) * (size * uniform(rng, [0.4, 1.0])));
            Figure::Polygon(outline.collect())
        }
        3 => Figure::Capsule(
            [centre, centre + axis * size * 4.0],
            [size * 0.1, size * uniform(rng, [0.02, 0.3])],
        ),
        _ => return marks(frame, centre, size * 0.2 + 1.5, rng),
    };
    let (color, slope) = (any_color(rng), unit_vector(rng) * uniform(rng, [0.0, 0.6]) / size);
    frame.paint(&shape, |p| (color * (1.0 + slope.dot(p - centre)).max(0.1), 1.0));
}

/// A slanted line of small strokes.
fn marks<R: Rng + ?Sized>(frame: &mut Frame, at: Vec2, height: f32, rng: &mut R) {
    let along = Vec2::from_angle(uniform(rng, [-0.4, 0.4])) * height;
    let ink = any_color(rng);
    for letter in 0..rng.random_range(4..22) {
        let foot = at + along * letter as f32 * 0.8;
        for _ in 0..2 {
            let mut end =
                || foot + (along * rng.random_range(0..2) as f32 + along.perp() * rng.random_range(0..3) as f32) * 0.5;
            let ends = [end(), end()];
            frame.fill(&Figure::Capsule(ends, [(height * 0.08).max(0.6); 2]), ink);
        }
    }
}

/// Stripes, checks, grids or dots, seen flat.
fn pattern<R: Rng + ?Sized>(frame: &mut Frame, rng: &mut R) {
    let (a, b) = (any_color(rng), quiet_color(rng));
    let period = uniform(rng, [5.0, 60.0]);
    let axis = unit_vector(rng);
    let width = uniform(rng, [0.1, 0.6]);
    let kind = rng.random_range(0..4);
    let stain = ValueNoise::new(rng);
    frame.map(|p, _| {
        let q = Vec2::new(p.dot(axis), p.dot(axis.perp())) / period;
        let cell = q - q.floor();
        let on = match kind {
            0 => cell.x < width,
            1 => (q.x.floor() + q.y.floor()) as i64 % 2 == 0,
            2 => cell.x < 0.15 || cell.y < 0.15,
            _ => cell.distance(Vec2::splat(0.5)) < width,
        };
        (if on { a } else { b }) * (1.0 + 0.2 * stain.fractal(p * 0.01, 3))
    });
}

/// A smooth field of a few colours: out-of-focus walls, skies, screens.
fn gradient<R: Rng + ?Sized>(frame: &mut Frame, rng: &mut R) {
    let blobs: Vec<(Vec2, f32, Vec3)> = (0..rng.random_range(2..6))
        .map(|_| (anywhere(frame, rng), uniform(rng, [60.0, 400.0]), any_color(rng)))
        .collect();
    frame.map(|p, base| {
        let (mut sum, mut weight) = (base * 0.2, 0.2);
        for (centre, size, color) in &blobs {
            let w = (-0.5 * (p.distance(*centre) / size).powi(2)).exp();
            sum += *color * w;
            weight += w;
        }
        sum / weight
    });
    for _ in 0..rng.random_range(0..8) {
        thing(frame, [6.0, 140.0], rng);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_pool_holds_48_backgrounds_and_40_artworks_that_all_differ() {
        let at = |texture: &Arc<Texture>| {
            let grid =
                (0..100).map(|k| texture.trilinear(Vec2::new((k % 10) as f32, (k / 10) as f32) / 10.0 + 0.05, 1.0));
            grid.collect::<Vec<_>>()
        };
        let pools: [Vec<Arc<Texture>>; 2] = [
            (0..BACKGROUNDS).map(background).collect(),
            (0..ARTWORKS).map(printed_artwork).collect(),
        ];
        assert_eq!(pools.each_ref().map(Vec::len), [48, 40]);
        for pool in pools {
            let values: Vec<_> = pool.iter().map(at).collect();
            assert!((0..values.len()).all(|i| (0..i).all(|j| values[i] != values[j])));
            // None of them is a single colour.
            assert!(values.iter().all(|v| v.iter().any(|c| c.distance(v[0]) > 0.02)));
        }
    }

    #[test]
    fn coordinates_beyond_the_edge_are_reflected() {
        for (from, to) in [(0.25, 0.25), (1.25, 0.75), (-0.25, 0.25), (2.25, 0.25), (-1.25, 0.75)] {
            assert!((mirrored(Vec2::splat(from)) - Vec2::splat(to)).length() < 1e-6);
        }
    }
}
