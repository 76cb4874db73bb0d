//! Balls and boxes of stone, wood and cloth on a table, ray-cast with soft shadows.

use super::exposure::{Exposure, SolidNoise, natural_color, smooth_step};
use crate::study::finding::dice::{Dice, uniform, uniform_in};
use deepsft_geometry::glam::{Vec2, Vec3};
use rand::RngExt;

const SHADOW_RAYS: usize = 4;

#[derive(Clone, Copy)]
enum Material {
    Marble,
    Wood,
    Speckles,
    Cloth,
}

/// A ball, or a box turned about the vertical.
struct Thing {
    centre: Vec3,
    /// Half sizes; of a ball all the same.
    half: Vec3,
    turn: Option<Vec2>,
    material: Material,
    colors: [Vec3; 2],
    grain: f32,
    shine: f32,
}

impl Thing {
    fn random(dice: &mut Dice, materials: [Material; 4]) -> Self {
        let at = Vec2::new(uniform(dice, -3.2, 3.2), uniform(dice, -2.2, 4.5));
        let size = uniform(dice, 0.15, 0.75);
        let turn = dice.random_bool(0.5).then(|| Vec2::from_angle(uniform(dice, 0.0, 1.6)));
        let half = match turn {
            Some(_) => Vec3::new(size, size * uniform(dice, 0.2, 2.2), size * uniform(dice, 0.3, 1.0)),
            None => Vec3::splat(size),
        };
        Self {
            centre: Vec3::new(at.x, half.y, at.y),
            half,
            turn,
            material: materials[dice.random_range(0..4)],
            colors: [natural_color(dice, [0.2, 0.7]), natural_color(dice, [0.02, 0.3])],
            grain: uniform(dice, 1.0, 6.0),
            shine: uniform(dice, 0.0, 0.8),
        }
    }

    /// `v` in the directions of the box.
    fn own(&self, v: Vec3) -> Vec3 {
        let turn = self.turn.unwrap_or(Vec2::X);
        let plane = turn.rotate(Vec2::new(v.x, v.z));
        Vec3::new(plane.x, v.y, plane.y)
    }

    /// Distance along the ray and normal where it meets the thing.
    fn hit(&self, from: Vec3, along: Vec3) -> Option<(f32, Vec3)> {
        let offset = from - self.centre;
        let Some(turn) = self.turn else {
            let middle = -offset.dot(along);
            let square = self.half.x.powi(2) - offset.length_squared() + middle * middle;
            let near = middle - square.max(0.0).sqrt();
            return (square > 0.0 && near > 1e-3).then(|| (near, (offset + along * near) / self.half.x));
        };
        let (o, d) = (self.own(offset), self.own(along));
        let (a, b) = ((-self.half - o) / d, (self.half - o) / d);
        let (enter, leave) = (a.min(b), a.max(b).min_element());
        let near = enter.max_element();
        if near > leave || near < 1e-3 {
            return None;
        }
        let face = Vec3::from(enter.to_array().map(|t| if t == near { 1.0 } else { 0.0 })) * -d.signum();
        let plane = Vec2::new(turn.x, -turn.y).rotate(Vec2::new(face.x, face.z));
        Some((near, Vec3::new(plane.x, face.y, plane.y)))
    }

    fn color(&self, point: Vec3, noise: &SolidNoise) -> Vec3 {
        let p = self.own(point - self.centre) * self.grain + self.half * 91.0;
        let mix = match self.material {
            Material::Marble => 0.5 + 0.5 * (p.x * 2.0 + 4.0 * noise.fractal(p, 7)).sin(),
            Material::Wood => (Vec2::new(p.x, p.z * 0.2).length() * 3.0 + noise.fractal(p * 0.7, 6)).fract(),
            Material::Speckles => smooth_step(0.1, 0.25, noise.fractal(p * 3.0, 5)),
            Material::Cloth => {
                let thread = (p * 14.0).map(f32::sin);
                0.5 + 0.2 * (thread.x * thread.y + thread.z) + 0.5 * noise.fractal(p * 0.8, 6)
            }
        };
        let dirt = 1.0 + 0.35 * noise.fractal(p * 5.0, 6);
        self.colors[0].lerp(self.colors[1], mix.clamp(0.0, 1.0)) * dirt
    }
}

/// Things on a table before a dim room.
pub(super) fn still_life(exposure: &mut Exposure, dice: &mut Dice) {
    let noise = SolidNoise::new(dice);
    let materials = [Material::Marble, Material::Wood, Material::Speckles, Material::Cloth];
    let count = dice.random_range(10..36);
    let things: Vec<Thing> = (0..count).map(|_| Thing::random(dice, materials)).collect();
    let mut table = Thing::random(dice, materials);
    (table.centre, table.half, table.turn) = (Vec3::ZERO, Vec3::ONE, Some(Vec2::from_angle(uniform(dice, 0.0, 3.0))));
    let eye = Vec3::new(uniform(dice, -1.5, 1.5), uniform(dice, 1.5, 4.0), -6.0);
    let forward = (Vec3::new(0.0, uniform(dice, 0.0, 0.5), 0.5) - eye).normalize();
    let right = Vec3::Y.cross(forward).normalize();
    let up = forward.cross(right);
    let sun = uniform_in(dice, [[-1.0, 1.0], [0.5, 1.3], [-1.0, 0.3]]).normalize();
    let (soft, sunlight) = (uniform(dice, 0.02, 0.25), uniform(dice, 0.6, 1.6));
    let ambient = uniform(dice, 0.15, 0.5);
    let room = [natural_color(dice, [0.05, 0.4]), natural_color(dice, [0.05, 0.4])];
    let focal = exposure.size().max_element() * uniform(dice, 0.9, 1.5);
    let nearest = |from: Vec3, along: Vec3| {
        let hits = things.iter().filter_map(|t| t.hit(from, along).map(|(d, n)| (d, n, t)));
        hits.min_by(|a, b| a.0.total_cmp(&b.0))
    };
    for row in 0..exposure.height {
        for column in 0..exposure.width {
            let offset = Vec2::new(column as f32 + 0.5, row as f32 + 0.5) - exposure.size() / 2.0;
            let ray = (forward * focal + right * offset.x - up * offset.y).normalize();
            let ground = -eye.y / ray.y.min(-1e-6);
            let on_table = (ground, Vec3::Y, &table);
            let found = nearest(eye, ray).filter(|(d, ..)| *d < ground || ray.y >= 0.0);
            let Some((distance, normal, thing)) = found.or((ray.y < 0.0 && ground < 40.0).then_some(on_table)) else {
                let mix = smooth_step(-0.1, 0.4, ray.y + 0.3 * noise.fractal(ray * 3.0, 3));
                exposure.set(column, row, room[0].lerp(room[1], mix), 6.0);
                continue;
            };
            let point = eye + ray * distance;
            let mut direct = 0.0;
            for _ in 0..SHADOW_RAYS {
                let spread = Vec3::new(uniform(dice, -1.0, 1.0), 0.0, uniform(dice, -1.0, 1.0)) * soft;
                let towards = (sun + spread).normalize();
                if !things.iter().any(|t| t.hit(point + normal * 2e-3, towards).is_some()) {
                    direct += normal.dot(towards).max(0.0) / SHADOW_RAYS as f32;
                }
            }
            let mirrored = ray - normal * (2.0 * ray.dot(normal));
            let gloss = thing.shine * mirrored.dot(sun).max(0.0).powi(40) * direct.min(1.0) * 2.0;
            let contact = smooth_step(-0.1, 0.5, point.y + 0.5 * normal.y);
            let sky = ambient * (0.6 + 0.4 * normal.y) * (0.5 + 0.5 * contact);
            let light = thing.color(point, &noise) * (sunlight * direct + sky) + gloss;
            exposure.set(column, row, light, distance / 6.5);
        }
    }
}
