//! How well a template explains a picture.

use super::TemplateLuminance;
use deepsft_geometry::{Maps, Picture};

fn noise(size: usize, seed: u32) -> Picture {
    let mut state = seed;
    Picture::from_fn(size, size, |_, _| {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        [(state >> 24) as u8; 3]
    })
}

/// Every pixel sees the texel below it.
fn identity(size: usize) -> Maps {
    let mut maps = Maps::empty((size, size));
    for pixel in 0..size * size {
        let at = |i: usize| (i as f32 + 0.5) / size as f32;
        maps.set(pixel, 500.0, [at(pixel % size), at(pixel / size)]);
    }
    maps
}

/// Smooth art: large blobs, so that the extra mipmap levels keep it.
fn blobs() -> Picture {
    let coarse = noise(12, 5);
    Picture::from_fn(96, 96, |x, y| {
        let c = coarse.sample(x as f64 / 8.0, y as f64 / 8.0);
        c.map(|v| v as u8)
    })
}

#[test]
fn the_template_itself_under_other_light_is_consistent() {
    let template = blobs();
    let dim = Picture::from_fn(96, 96, |x, y| template.pixel(x, y).map(|v| v / 3 + 40));
    let c = TemplateLuminance::new(&template)
        .consistency(&dim, &identity(96))
        .unwrap();
    assert!(c > 0.95, "{c}");
}

#[test]
fn another_picture_is_not_consistent() {
    let other = noise(96, 99);
    let c = TemplateLuminance::new(&blobs())
        .consistency(&other, &identity(96))
        .unwrap();
    assert!(c.abs() < 0.15, "{c}");
}

#[test]
fn nothing_seen_or_nothing_to_see_has_no_answer() {
    let luminance = TemplateLuminance::new(&blobs());
    assert_eq!(luminance.consistency(&blobs(), &Maps::empty((96, 96))), None);
    let flat = TemplateLuminance::new(&Picture::from_fn(96, 96, |_, _| [128; 3]));
    assert_eq!(flat.consistency(&blobs(), &identity(96)), None);
}
