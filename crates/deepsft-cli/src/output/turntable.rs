//! A template from several sides, for a look at whether it is right.

use super::canvas::Canvas;
use super::lettering::{Align, Lettering};
use anyhow::Result;
use deepsft::{encode_png, template_to_files};
use deepsft_geometry::glam::{DQuat, DVec3};
use deepsft_geometry::{Camera, Picture, Template};
use deepsft_synth::{SynthConfig, Synthesizer};
use std::f64::consts::{FRAC_PI_2, PI};
use std::path::Path;

/// Name of the picture in a template's folder.
pub const TURNTABLE_FILE: &str = "views.png";

/// Side of a view, pixels.
const SIDE: usize = 360;

/// Distance of the camera in radii of the object.
const RADII: f64 = 4.0;

/// Nothing nearer than this is drawn, mm, with room.
const NEAR_MM: f64 = 60.0;

/// `template` from the front, its left, the back, its right, above and below, under even light.
pub fn turntable(template: &Template) -> Result<Picture> {
    let radius = template.extent_mm().length() / 2.0;
    let distance = RADII * radius + NEAR_MM;
    let side = SIDE as f64;
    let focal = 0.47 * side * distance / radius;
    let camera = Camera::pinhole(SIDE as u32, SIDE as u32, focal, focal, side / 2.0, side / 2.0)?;
    let config = SynthConfig {
        camera,
        ..SynthConfig::default()
    };
    let synthesizer = Synthesizer::new(template, config)?;
    let views = [
        ("front", DQuat::IDENTITY),
        ("its left", DQuat::from_rotation_y(FRAC_PI_2)),
        ("back", DQuat::from_rotation_y(PI)),
        ("its right", DQuat::from_rotation_y(-FRAC_PI_2)),
        ("above", DQuat::from_rotation_x(FRAC_PI_2)),
        ("below", DQuat::from_rotation_x(-FRAC_PI_2)),
    ];
    let mut canvas = Canvas::new(3 * SIDE, 2 * SIDE, [0; 3]);
    for (number, (name, turn)) in views.into_iter().enumerate() {
        let place = |p: &DVec3| turn * *p + distance * DVec3::Z;
        let view = synthesizer.render_clean(template.mesh().vertices().iter().map(place).collect())?;
        let (left, top) = (number % 3 * SIDE, number / 3 * SIDE);
        canvas.draw(&view.image, left, top);
        let corner = (left as f64 + 12.0, top as f64 + 18.0);
        canvas.write(name, corner, Align::Left, Lettering::semibold(16.0, [255; 3]));
    }
    Ok(canvas.into_picture())
}

/// Writes a template that is no sheet into the folder `out`, with a picture of it from several sides.
pub fn write_template(out: &Path, template: &Template) -> Result<()> {
    let mut files = template_to_files(template)?;
    files.insert(TURNTABLE_FILE.to_owned(), encode_png(&turntable(template)?)?);
    deepsft_formats::write_folder(out, &deepsft_formats::FolderKind::TEMPLATE, &files)?;
    let (size, texture) = (template.extent_mm(), template.texture());
    println!(
        "template of {:.1} x {:.1} x {:.1} mm with {} faces and {} x {} texels: {}",
        size.x,
        size.y,
        size.z,
        template.mesh().faces().len(),
        texture.width(),
        texture.height(),
        out.display()
    );
    println!("look at it: {}", out.join(TURNTABLE_FILE).display());
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use deepsft_geometry::TriangleMesh;
    use deepsft_geometry::glam::DVec2;

    #[test]
    fn each_side_of_a_cube_is_in_its_view() {
        // Six charts side by side, each of one colour, in the order of the views. Corners: outwards counter-clockwise.
        let (x, y, z) = (DVec3::X, DVec3::Y, DVec3::Z);
        let sides = [(-z, y, x), (x, y, z), (z, y, -x), (-x, y, -z), (-y, -z, x), (y, z, x)];
        let (mut vertices, mut uv, mut faces) = (vec![], vec![], vec![]);
        for (k, (outwards, down, right)) in sides.into_iter().enumerate() {
            let n = vertices.len();
            for (a, b) in [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)] {
                vertices.push(50.0 * (outwards + a * down + b * right));
                uv.push(DVec2::new((k as f64 + 0.5 + 0.4 * b) / 6.0, 0.5 + 0.4 * a));
            }
            faces.extend([[n, n + 1, n + 2], [n, n + 2, n + 3]]);
        }
        let colors = [
            [250, 0, 0],
            [0, 250, 0],
            [0, 0, 250],
            [250, 250, 0],
            [0, 250, 250],
            [250, 0, 250],
        ];
        let texture = Picture::from_fn(60, 10, |x, _| colors[x / 10]);
        let template = Template::of_mesh(TriangleMesh::new(vertices, uv, faces).unwrap(), texture).unwrap();
        let picture = turntable(&template).unwrap();
        for (k, color) in colors.into_iter().enumerate() {
            let seen = picture.pixel(k % 3 * SIDE + SIDE / 2, k / 3 * SIDE + SIDE / 2);
            for channel in 0..3 {
                assert!(
                    seen[channel].abs_diff(color[channel]) < 30,
                    "view {k}: {seen:?} for {color:?}"
                );
            }
        }
    }
}
