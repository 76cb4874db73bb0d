//! A sheet in the image.

use crate::painting::srgb8_from_linear;
use crate::{Sample, SynthConfig, Synthesizer};
use deepsft_geometry::glam::{DVec3, Vec3};
use deepsft_geometry::{Picture, Template};

/// A sheet that faces the camera at depth `z`, mm, in even light before mid grey.
fn flat(texture: Picture, z: f64) -> Sample {
    let template = Template::thin_shell(texture, 297.0, 210.0).unwrap();
    let vertices = template.mesh().vertices().iter().map(|p| *p + DVec3::Z * z);
    let synthesizer = Synthesizer::new(&template, SynthConfig::default()).unwrap();
    synthesizer.render_clean(vertices.collect()).unwrap()
}

#[test]
fn the_sheet_is_not_mirrored_the_first_texel_is_at_the_top_left() {
    // Red top left, green top right, blue bottom left, white bottom right.
    let corner = |x: usize, y: usize| [[255, 0, 0], [0, 255, 0], [0, 0, 255], [255; 3]][x / 32 + 2 * (y / 32)];
    let sample = flat(Picture::from_fn(64, 64, corner), 500.0);
    let picture = &sample.image;
    // f / z = 0.76 px/mm: the sheet spans 240 +- 112.9, 135 +- 79.8 px.
    assert_eq!(picture.pixel(135, 60), [255, 0, 0]);
    assert_eq!(picture.pixel(345, 60), [0, 255, 0]);
    assert_eq!(picture.pixel(135, 210), [0, 0, 255]);
    assert_eq!(picture.pixel(345, 210), [255; 3]);
    let [u, v] = sample.truth.registration()[60 * 480 + 135];
    // ((135.5 - 240) / 0.76 / 297 + 0.5, (60.5 - 135) / 0.76 / 210 + 0.5)
    assert!((u - 0.037_037).abs() < 1e-4 && (v - 0.033_208).abs() < 1e-4, "{u} {v}");
}

#[test]
fn what_is_too_near_or_behind_the_camera_is_not_drawn() {
    let ground = srgb8_from_linear(Vec3::splat(0.2));
    for z in [-500.0, 0.0, 5.0] {
        let sample = flat(Picture::from_fn(1, 1, |_, _| [255; 3]), z);
        assert_eq!(sample.truth.area(), 0);
        assert!(sample.image.rgb().chunks_exact(3).all(|color| color == ground));
    }
}
