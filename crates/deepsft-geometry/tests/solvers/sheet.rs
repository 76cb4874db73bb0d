//! A printed sheet before a wall, drawn with its true maps.

use deepsft_geometry::glam::DVec3;
use deepsft_geometry::{Maps, Picture, Template};

/// A print that is nowhere like itself, in strokes of 5 to 20 mm.
fn print() -> Picture {
    Picture::from_fn(594, 420, |x, y| {
        let (x, y) = (x as f64 / 2.0, y as f64 / 2.0);
        let wave = |a: f64, b: f64, c: f64| (a * x + b * y + c * (x * y) / 200.0).sin();
        let value = |k: f64| 120.0 + 45.0 * wave(0.31 + k, 0.22, 0.2) + 40.0 * wave(0.11, -0.45 + k, 0.3);
        [value(0.0) as u8, value(0.05) as u8, value(0.1) as u8]
    })
}

pub fn template() -> Template {
    Template::thin_shell(print(), 297.0, 210.0).unwrap()
}

/// The sheet bent as [`place`] says.
pub fn bent(template: &Template, time_s: f64) -> Vec<DVec3> {
    template.mesh().vertices().iter().map(|p| place(p, time_s)).collect()
}

/// Where a point of the sheet is when it is bent over a cylinder of radius 180 mm, tilted, some half a metre away: an isometry. With
/// `time_s` it sways with up to 200 mm/s and bends more and less.
pub fn place(p: &DVec3, time_s: f64) -> DVec3 {
    let (sway, tilt) = ((4.0 * time_s).sin(), 0.35 + 0.2 * (3.0 * time_s).sin());
    let radius = 180.0 + 60.0 * sway;
    let angle = (p.x + 0.3 * p.y) / 1.09_f64.sqrt() / radius;
    let along = (p.y - 0.3 * p.x) / 1.09_f64.sqrt();
    let across = radius * angle.sin();
    let lift = radius * (1.0 - angle.cos());
    let x = (across - 0.3 * along) / 1.09_f64.sqrt();
    let y = (along + 0.3 * across) / 1.09_f64.sqrt();
    let (y, z) = (y * tilt.cos() - lift * tilt.sin(), y * tilt.sin() + lift * tilt.cos());
    DVec3::new(x + 20.0 + 50.0 * sway, y - 10.0, z + 430.0)
}

/// The sheet in light that falls off to the right, before a chequered wall.
pub fn image(template: &Template, truth: &Maps) -> Picture {
    let texture = template.texture().halved();
    Picture::from_fn(truth.size().width, truth.size().height, |x, y| {
        let pixel = y * truth.size().width + x;
        if !truth.inside(pixel) {
            return [if (x / 12 + y / 9) % 2 == 0 { 60 } else { 150 }; 3];
        }
        let [u, v] = truth.registration()[pixel].map(f64::from);
        let color = texture.sample(u * texture.width() as f64, v * texture.height() as f64);
        let light = 0.9 - 0.4 * x as f32 / truth.size().width as f32;
        color.map(|c| (light * c + 10.0) as u8)
    })
}

/// The sheet with its right fifth folded away by `angle` over a strip of 20 mm, or towards the camera where it is negative, turned to the left
/// by 11 degrees: an isometry.
pub fn folded(template: &Template, angle: f64) -> Vec<DVec3> {
    let (begin, radius, turn) = (90.0, 20.0, 0.2_f64);
    let place = |p: &DVec3| {
        let along = p.x - begin;
        let bent = (along / radius).clamp(0.0, angle.abs());
        let straight = (along - angle.abs() * radius).max(0.0);
        let x = begin + along.min(0.0) + radius * bent.sin() + straight * angle.cos();
        let z = angle.signum() * (radius * (1.0 - bent.cos()) + straight * angle.abs().sin());
        let (x, z) = (x * turn.cos() + z * turn.sin(), z * turn.cos() - x * turn.sin());
        DVec3::new(x, p.y, z + 450.0)
    };
    template.mesh().vertices().iter().map(place).collect()
}
