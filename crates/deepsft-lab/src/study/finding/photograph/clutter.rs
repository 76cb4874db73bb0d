//! Heaps of leaves, flowers and pebbles: thousands of shaded things, each with its shadow, from the lowest to the highest.

use super::exposure::{Exposure, natural_color, smooth_step};
use crate::study::finding::dice::{Dice, uniform, uniform_in};
use deepsft_geometry::glam::{Vec2, Vec3};
use deepsft_synth::painting::ValueNoise;
use rand::RngExt;
use std::f32::consts::TAU;

/// One thing in the picture.
struct Piece {
    centre: Vec2,
    axis: Vec2,
    /// Half length and half width, pixels.
    half: Vec2,
    color: Vec3,
    /// Of the lowest 0, of the highest 1.
    level: f32,
}

/// Paints pieces: `light(p, piece)` with p from -1 to 1 along and across the piece, `None` outside it.
fn heap(exposure: &mut Exposure, pieces: &[Piece], shadow: Vec2, light: impl Fn(Vec2, Vec2, &Piece) -> Option<Vec3>) {
    let (width, height) = (exposure.width, exposure.height);
    for piece in pieces {
        let reach = piece.half.max_element() + shadow.length() + 1.0;
        let range = |middle: f32, count: usize| {
            let end = ((middle + reach).max(0.0) as usize + 1).min(count);
            ((middle - reach).max(0.0) as usize).min(end)..end
        };
        let local = |p: Vec2| {
            let v = p - piece.centre;
            Vec2::new(v.dot(piece.axis), v.dot(piece.axis.perp())) / piece.half
        };
        for row in range(piece.centre.y, height) {
            for column in range(piece.centre.x, width) {
                let p = Vec2::new(column as f32 + 0.5, row as f32 + 0.5);
                if let Some(light) = light(local(p), p, piece) {
                    exposure.set(column, row, light, 2.5 - 1.8 * piece.level);
                    continue;
                }
                let cast = [0.6, 1.0, 1.4].map(|k| light(local(p - shadow * k), p, piece).is_some());
                let dark = cast.iter().filter(|&&c| c).count() as f32 / 3.0;
                exposure.light[row * width + column] *= 1.0 - 0.4 * dark;
            }
        }
    }
}

/// Colours of one kind of thing: around one or two of them.
fn colors(dice: &mut Dice, base: [Vec3; 2]) -> impl Fn(&mut Dice) -> Vec3 + use<> {
    let spread = uniform(dice, 0.1, 0.5);
    move |dice| {
        let vary = uniform_in(dice, [[-1.0, 1.0]; 3]);
        base[dice.random_range(0..2)] * (1.0 + spread * vary) * uniform(dice, 0.6, 1.2)
    }
}

fn soil(exposure: &mut Exposure, dice: &mut Dice) {
    let (noise, dark) = (ValueNoise::new(dice), natural_color(dice, [0.02, 0.1]));
    for row in 0..exposure.height {
        for column in 0..exposure.width {
            let p = Vec2::new(column as f32, row as f32);
            let light = dark * (1.0 + 0.9 * noise.fractal(p * 0.02, 8));
            exposure.set(column, row, light, 3.0);
        }
    }
}

/// Leaves of a bush or on the ground, with some flowers.
pub(super) fn leaves(exposure: &mut Exposure, dice: &mut Dice) {
    soil(exposure, dice);
    let size = exposure.size();
    let green = uniform_in(dice, [[0.05, 0.35], [0.15, 0.4], [0.02, 0.1]]);
    let other = if dice.random_bool(0.5) {
        natural_color(dice, [0.1, 0.4])
    } else {
        green * 0.6
    };
    let leaf = colors(dice, [green, other]);
    let petal_base = natural_color(dice, [0.4, 0.8]);
    let petal = colors(dice, [petal_base, petal_base]);
    let flowers = dice.random_range(0..30);
    let (long, slim) = (uniform(dice, 14.0, 60.0), uniform(dice, 0.25, 0.6));
    let layers = uniform(dice, 1.5, 5.0);
    let count = ((layers * size.element_product() / (long * long * slim)) as usize).min(6000);
    let mut pieces = Vec::new();
    for k in 0..count {
        let level = k as f32 / count as f32;
        let half = long * uniform(dice, 0.4, 1.2) * (0.5 + 0.5 * level);
        pieces.push(Piece {
            centre: Vec2::new(uniform(dice, 0.0, size.x), uniform(dice, 0.0, size.y)),
            axis: Vec2::from_angle(uniform(dice, 0.0, TAU)),
            half: Vec2::new(half, half * slim * uniform(dice, 0.5, 1.3)),
            color: leaf(dice) * (0.3 + 0.9 * level),
            level,
        });
        if flowers > 0 && k % (count / flowers + 1) == count / (2 * flowers) {
            let middle = Vec2::new(uniform(dice, 0.0, size.x), uniform(dice, 0.0, size.y));
            let (petals, radius) = (dice.random_range(5..13), half * uniform(dice, 0.5, 1.0));
            let (color, start) = (petal(dice) * (0.4 + 0.8 * level), uniform(dice, 0.0, 6.0));
            let one = |axis: Vec2, half: Vec2, color: Vec3| Piece {
                centre: middle + axis * half.x,
                axis,
                half,
                color,
                level,
            };
            for k in 0..petals {
                let axis = Vec2::from_angle(start + TAU * k as f32 / petals as f32);
                pieces.push(one(axis, Vec2::new(radius, radius * 2.2 / petals as f32), color));
            }
            let yellow = Vec3::new(0.7, 0.5, 0.05) * (0.4 + 0.8 * level);
            pieces.push(one(Vec2::X * 1e-3, Vec2::splat(radius * 0.35), yellow));
        }
    }
    let (noise, bend) = (ValueNoise::new(dice), uniform(dice, -0.5, 0.5));
    let veins = uniform(dice, 4.0, 12.0);
    let shadow = Vec2::new(uniform(dice, -6.0, 6.0), uniform(dice, 2.0, 9.0));
    heap(exposure, &pieces, shadow, |p, at, piece| {
        let p = Vec2::new(p.x, p.y + bend * (p.x * p.x - 0.3));
        let edge = (1.0 - p.x * p.x).max(0.0).powf(0.7);
        if p.x.abs() >= 1.0 || p.y.abs() >= edge {
            return None;
        }
        let side = if p.y * piece.axis.x > 0.0 { 1.15 } else { 0.8 };
        let rib = 1.0 - 0.3 * smooth_step(0.06, 0.0, p.y.abs());
        let vein = 1.0 + 0.12 * ((p.x + p.y.abs() * 0.6) * veins * 3.0).sin();
        let spots = 1.0 + 0.45 * noise.fractal(at * 0.05 + piece.centre, 7);
        Some(piece.color * (side * rib * vein * spots * (1.1 - 0.4 * p.y.abs() / edge.max(0.1))))
    });
}

/// Pebbles on a beach, or fruit in a box: rounded, shaded, of many sizes.
pub(super) fn pebbles(exposure: &mut Exposure, dice: &mut Dice) {
    soil(exposure, dice);
    let size = exposure.size();
    let base = [natural_color(dice, [0.2, 0.6]), natural_color(dice, [0.05, 0.5])];
    let stone = colors(dice, base);
    let largest = uniform(dice, 20.0, 75.0);
    let layers = uniform(dice, 4.0, 12.0);
    let count = ((layers * size.element_product() / (largest * largest)) as usize).min(6000);
    let pieces: Vec<Piece> = (0..count)
        .map(|k| {
            let radius = largest * (0.12 + 0.88 * uniform(dice, 0.0, 1.0).powi(3));
            Piece {
                centre: Vec2::new(uniform(dice, 0.0, size.x), uniform(dice, 0.0, size.y)),
                axis: Vec2::from_angle(uniform(dice, 0.0, TAU)),
                half: radius * Vec2::new(1.0, uniform(dice, 0.5, 1.0)),
                color: stone(dice),
                level: k as f32 / count as f32,
            }
        })
        .collect();
    let noise = ValueNoise::new(dice);
    let sun = uniform_in(dice, [[-1.0, 1.0], [-1.0, 1.0], [0.5, 1.2]]).normalize();
    let (bands, shine) = (uniform(dice, 0.0, 0.7), uniform(dice, 0.0, 0.5));
    let shadow = Vec2::new(-sun.x, -sun.y) * uniform(dice, 3.0, 9.0);
    heap(exposure, &pieces, shadow, |p, at, piece| {
        let lumps = 1.0 + 0.12 * noise.fractal(p * 1.3 + piece.centre, 2);
        let r = (p * lumps).length();
        if r >= 1.0 {
            return None;
        }
        let plane = piece.axis.rotate(p) * r;
        let normal = Vec3::new(plane.x, plane.y, (1.0 - r.powi(3)).max(0.05).sqrt()).normalize();
        let local = at * 0.06 + piece.centre * 3.1;
        let grain = noise.fractal(local, 8);
        let band = (piece.axis.dot(at) * 0.25 + 5.0 * grain).sin();
        let specks = smooth_step(0.25, 0.4, noise.fractal(local * 6.0, 4));
        let color = piece.color * (1.0 + 0.7 * grain + bands * 0.5 * band) * (1.0 - 0.5 * specks);
        let direct = normal.dot(sun).max(0.0);
        Some(color * (0.2 + 0.9 * direct) + shine * direct.powi(30))
    });
}
