//! Land and cities under a sky: height fields drawn column by column from near to far.

use super::exposure::{Exposure, natural_color, of_cell, smooth_step};
use crate::study::finding::dice::{Dice, uniform, uniform_in};
use deepsft_geometry::glam::{Vec2, Vec3};
use deepsft_synth::painting::ValueNoise;
use rand::RngExt;

/// A camera that looks along z, its image plane upright.
struct View {
    eye: Vec3,
    focal: f32,
    horizon_row: f32,
    near: f32,
    far: f32,
}

/// A point of the surface as the view meets it.
struct Hit {
    point: Vec3,
    distance: f32,
    /// The point of the step before.
    before: Vec2,
    /// Whether the surface rises steeply here.
    wall: bool,
}

/// Draws the surface `height(x, z)` and what `light` says of its points; `sky` where there is none. `step`: length of a step and
/// its growth with the distance.
fn draw(
    exposure: &mut Exposure,
    view: &View,
    step: [f32; 2],
    height: impl Fn(Vec2) -> f32,
    light: impl Fn(&Hit) -> Vec3,
    sky: impl Fn(Vec2) -> Vec3,
) {
    let size = exposure.size();
    let focus = view.near + (view.far - view.near) * 0.04;
    for column in 0..exposure.width {
        let across = (column as f32 + 0.5 - size.x / 2.0) / view.focal;
        let mut top = exposure.height;
        let (mut z, mut before_z, mut before_row) = (view.near, view.near, size.y);
        while z < view.far && top > 0 {
            let at = |z: f32| Vec2::new(view.eye.x + across * z, view.eye.z + z);
            let row = view.horizon_row + view.focal * (view.eye.y - height(at(z))) / z;
            let wall = before_row - row > 3.0 * view.focal * (z - before_z) / z;
            while top > 0 && top as f32 - 0.5 >= row {
                let r = top as f32 - 0.5;
                let part = ((before_row - r) / (before_row - row).max(1e-3)).clamp(0.0, 1.0);
                let distance = if wall { z } else { before_z + (z - before_z) * part };
                let plane = at(distance);
                let up = view.eye.y - (r - view.horizon_row) * distance / view.focal;
                let hit = Hit {
                    point: Vec3::new(plane.x, up, plane.y),
                    distance,
                    before: at(before_z),
                    wall,
                };
                top -= 1;
                exposure.set(column, top, light(&hit), distance / focus);
            }
            (before_z, before_row) = (z, row);
            z += step[0] + step[1] * z;
        }
        for row in 0..top {
            let ray = Vec2::new(across, (view.horizon_row - row as f32 - 0.5) / view.focal);
            exposure.set(column, row, sky(ray), view.far / focus);
        }
    }
}

/// A sky with clouds, and the light it gives.
struct Sky {
    zenith: Vec3,
    horizon: Vec3,
    cloud: ValueNoise,
    clouds: f32,
    sun: Vec3,
    sunlight: Vec3,
}

impl Sky {
    fn new(dice: &mut Dice) -> Self {
        let evening = dice.random_bool(0.3);
        let sun = uniform_in(dice, [[-1.0, 1.0], [0.25, 1.0], [-0.9, 0.5]]);
        let warm = if evening {
            Vec3::new(1.0, 0.6, 0.35)
        } else {
            Vec3::new(1.0, 0.95, 0.85)
        };
        Self {
            zenith: Vec3::new(0.12, 0.25, 0.55) * uniform(dice, 0.5, 1.5),
            horizon: warm * uniform(dice, 0.5, 1.0),
            cloud: ValueNoise::new(dice),
            clouds: uniform(dice, -0.6, 0.5),
            sun: sun.normalize(),
            sunlight: warm * uniform(dice, 0.8, 2.0),
        }
    }

    /// Its light along a ray that goes 1 forward.
    fn at(&self, ray: Vec2) -> Vec3 {
        let up = ray.y.max(0.0) + 0.02;
        let color = self.horizon.lerp(self.zenith, (up * 2.2).min(1.0).sqrt());
        let plane = Vec2::new(ray.x / up, 1.0 / up);
        let thick = smooth_step(-0.25, 0.5, self.cloud.fractal(plane * 0.9, 8) + self.clouds);
        let lit = 0.55 + 0.6 * (self.cloud.fractal(plane * 0.9 + 0.12, 8) + 0.3).clamp(0.0, 1.0);
        let cloud = Vec3::splat(lit) * self.sunlight.lerp(Vec3::ONE, 0.5);
        color.lerp(cloud, thick * (up * 8.0).min(1.0))
    }

    fn hazed(&self, color: Vec3, distance: f32, sight: f32) -> Vec3 {
        self.horizon.lerp(color, (-distance / sight).exp())
    }
}

/// Hills or mountains with rock, grass, woods and snow, sometimes with a lake.
pub(super) fn landscape(exposure: &mut Exposure, dice: &mut Dice) {
    let (sky, size) = (Sky::new(dice), exposure.size());
    let [ground, wood, stain] = std::array::from_fn(|_| ValueNoise::new(dice));
    let (rough, tall) = (uniform(dice, 0.0025, 0.008), uniform(dice, 60.0, 260.0));
    let relief = |p: Vec2, octaves: usize| {
        let broad = ground.fractal(p * rough, octaves);
        tall * (broad + 0.35 * (1.0 - 2.0 * ground.fractal(p * rough * 0.6 + 91.0, octaves).abs()))
    };
    let lake = if dice.random_bool(0.5) {
        uniform(dice, -0.5, -0.05) * tall
    } else {
        -1e4
    };
    let woods = uniform(dice, -0.5, 0.5);
    let wooded = |p: Vec2| smooth_step(0.0, 0.1, wood.fractal(p * rough * 2.5, 4) + woods);
    let height = |p: Vec2| {
        let trees = 4.0 * wooded(p) * (wood.at(p * 0.25) + 0.5 * wood.at(p * 0.6)).max(0.0);
        (relief(p, 9) + trees).max(lake)
    };
    let eye = Vec3::new(uniform(dice, -9e3, 9e3), 0.0, uniform(dice, -9e3, 9e3));
    let view = View {
        eye: eye.with_y(height(Vec2::new(eye.x, eye.z)) + uniform(dice, 8.0, 0.7 * tall)),
        focal: size.max_element() * uniform(dice, 0.8, 1.6),
        horizon_row: size.y * uniform(dice, 0.2, 0.5),
        near: 8.0,
        far: 6000.0,
    };
    let (rock, soil) = (natural_color(dice, [0.15, 0.4]), natural_color(dice, [0.1, 0.3]));
    let grass = uniform_in(dice, [[0.08, 0.3], [0.15, 0.3], [0.03, 0.08]]);
    let leaf = grass * Vec3::new(0.35, 0.5, 0.5);
    let snow_line = uniform(dice, 0.2, 1.4) * tall;
    let sight = uniform(dice, 1500.0, 9000.0);
    let light = |hit: &Hit| {
        let p = Vec2::new(hit.point.x, hit.point.z);
        if relief(p, 9) <= lake {
            let ripple = 0.3 * stain.fractal(Vec2::new(p.x * 0.05, p.y * 0.2), 6);
            let mirrored = sky.at(Vec2::new(0.1 * ripple, 0.12 + 0.5 * ripple.abs())) * 0.6;
            return sky.hazed(mirrored * (0.8 + ripple), hit.distance, sight);
        }
        let reach = 0.3 + 0.002 * hit.distance;
        let (dx, dz) = (Vec2::new(reach, 0.0), Vec2::new(0.0, reach));
        let slope = |d: Vec2| (height(p + d) - height(p - d)) / (2.0 * reach);
        let normal = Vec3::new(-slope(dx), 1.0, -slope(dz)).normalize();
        let patches = stain.fractal(p * 0.02, 10);
        let mut color = grass.lerp(soil, smooth_step(-0.1, 0.5, patches));
        color = color.lerp(rock, smooth_step(0.85, 0.6, normal.y + 0.2 * patches));
        let white = smooth_step(snow_line, snow_line + 0.2 * tall, hit.point.y + 60.0 * patches);
        color = color.lerp(Vec3::splat(0.85), white * smooth_step(0.5, 0.75, normal.y));
        color = color.lerp(leaf, wooded(p) * (1.0 - white));
        color *= 1.0 + 0.7 * stain.fractal(p * 0.7 + hit.point.y * 0.5, 7);
        let shadowed = (1..12).any(|k| {
            let along = sky.sun * (6.0 * (k * k) as f32 / sky.sun.y.max(0.2));
            let above = hit.point + along + Vec3::Y * 2.0;
            relief(Vec2::new(above.x, above.z), 4) > above.y
        });
        let direct = if shadowed { 0.0 } else { normal.dot(sky.sun).max(0.0) };
        let lit = sky.sunlight * direct + sky.zenith * (0.5 + 0.5 * normal.y);
        sky.hazed(color * lit, hit.distance, sight)
    };
    draw(exposure, &view, [0.5, 0.008], height, light, |ray| sky.at(ray));
}

/// Blocks of houses with streets between them, seen from a roof.
pub(super) fn city(exposure: &mut Exposure, dice: &mut Dice) {
    let (sky, size) = (Sky::new(dice), exposure.size());
    let (salt, stain): (u32, _) = (dice.random_range(0..9999), ValueNoise::new(dice));
    let block = uniform(dice, 18.0, 40.0);
    let street = uniform(dice, 0.1, 0.3);
    let tall = uniform(dice, 15.0, 70.0);
    let turn = Vec2::from_angle(uniform(dice, 0.1, 1.4));
    let back = Vec2::new(turn.x, -turn.y);
    let (wall, roof) = (natural_color(dice, [0.3, 0.7]), natural_color(dice, [0.15, 0.4]));
    let storey = uniform(dice, 3.0, 4.5);
    let lots = |p: Vec2| turn.rotate(p) / block;
    let house = |lot: Vec2| {
        let inside = lot - lot.floor();
        let built = inside.min_element() > street / 2.0 && inside.max_element() < 1.0 - street / 2.0;
        built.then(|| tall * (0.3 + of_cell(lot, salt).powi(3) * 2.2))
    };
    let height = |p: Vec2| {
        let lot = lots(p);
        let clutter = if of_cell(lot * 7.0, salt + 5) > 0.85 { 1.5 } else { 0.0 };
        house(lot).map_or(0.0, |h| h + clutter)
    };
    let eye = uniform_in(dice, [[-900.0, 900.0], [1.2, 3.0], [-900.0, 900.0]]);
    let view = View {
        eye: eye.with_y(tall * eye.y),
        focal: size.max_element() * uniform(dice, 0.7, 1.4),
        horizon_row: size.y * uniform(dice, 0.05, 0.35),
        near: 10.0,
        far: 2500.0,
    };
    let sight = uniform(dice, 500.0, 4000.0);
    let light = |hit: &Hit| {
        let p = Vec2::new(hit.point.x, hit.point.z);
        let lot = lots(p);
        let own = |salt_too: u32| of_cell(lot, salt + salt_too);
        let stains = 1.0 + 0.6 * stain.fractal(p * 0.3 + hit.point.y * 0.4, 7);
        let tint = (0.6 + 0.7 * own(1)) * Vec3::new(1.0 + 0.3 * own(2), 1.0, 1.1 - 0.4 * own(3));
        let (color, normal) = match house(lot) {
            Some(_) if hit.wall => {
                let from = lots(hit.before);
                let inside = from - lot.floor();
                let along_x = inside.x > street / 2.0 && inside.x < 1.0 - street / 2.0;
                let (along, axis) = if along_x { (lot.x, Vec2::Y) } else { (lot.y, Vec2::X) };
                let facing = back.rotate(axis * if along_x { from.y - lot.y } else { from.x - lot.x });
                let pane = Vec2::new(along * block / (2.0 + 2.5 * own(4)), hit.point.y / storey);
                let within = pane - pane.floor();
                let bay = of_cell(pane, salt + 9);
                let window = (0.25..0.75).contains(&within.x) && (0.3..0.8 - 0.2 * own(6)).contains(&within.y);
                let glass = Vec3::splat(0.03 + 0.25 * bay * bay) + sky.zenith * 0.3 * bay;
                let face = Vec3::new(facing.x, 0.0, facing.y).normalize_or_zero();
                (if window { glass } else { wall * tint }, face)
            }
            Some(_) => (roof * tint * (0.7 + 0.6 * of_cell(lot * 7.0, salt + 5)), Vec3::Y),
            None => {
                let car = of_cell(lot * Vec2::new(9.0, 5.0), salt + 7) > 0.82;
                let paint = Vec3::new(own(1), of_cell(lot * 9.0, 3), of_cell(lot * 9.0, 4));
                (if car { paint * 0.6 } else { Vec3::splat(0.12) }, Vec3::Y)
            }
        };
        let shaded = (1..14).any(|k| {
            let above = hit.point + sky.sun * (1.2 * (k * k) as f32 * 0.5 + 0.5) + normal * 0.3;
            height(Vec2::new(above.x, above.z)) > above.y
        });
        let direct = if shaded { 0.0 } else { normal.dot(sky.sun).max(0.0) };
        let open = 0.35 + 0.65 * (hit.point.y / tall).clamp(0.0, 1.0);
        let lit = sky.sunlight * direct + sky.horizon * 0.45 * open;
        sky.hazed(color * stains * lit, hit.distance, sight)
    };
    draw(exposure, &view, [0.25, 0.0016], height, light, |ray| sky.at(ray));
}
