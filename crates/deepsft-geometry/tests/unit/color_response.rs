//! A camera's colours, found from frames and their maps.

use deepsft_geometry::{ColorMatch, ColorResponse, Maps, Picture, photo_consistency_error};

/// 60 x 40 texels with contrast in every colour.
fn texture() -> Picture {
    Picture::from_fn(60, 40, |x, y| {
        [x, y, x + y].map(|value| if (value / 7) % 2 == 0 { 40 } else { 220 })
    })
}

/// Maps of a camera that sees texel (x, y) at the pixel (x + 10, y + 5).
fn maps() -> Maps {
    let mut maps = Maps::empty((100, 50));
    for y in 0..40 {
        for x in 0..60 {
            let uv = [(x as f32 + 0.5) / 60.0, (y as f32 + 0.5) / 40.0];
            maps.set((y + 5) * 100 + x + 10, 400.0, uv);
        }
    }
    maps
}

/// What that camera, with this `response`, shows of the texture under a light that adds `light` grey levels.
fn image(response: &ColorResponse, light: u8) -> Picture {
    let shown = response.apply(&texture());
    Picture::from_fn(100, 50, |x, y| {
        if (10..70).contains(&x) && (5..45).contains(&y) {
            shown.pixel(x - 10, y - 5).map(|value| value + light)
        } else {
            [7; 3]
        }
    })
}

const DULL: ColorResponse = ColorResponse {
    gain: [0.5, 0.6, 0.4],
    offset: [50.0, 30.0, 60.0],
};

#[test]
fn a_cameras_gains_and_offsets_are_found_whatever_the_light_of_each_frame() {
    let mut found = ColorMatch::default();
    assert_eq!(found.response(), ColorResponse::IDENTITY);
    // Light of 0 and 20 levels is an offset of 10 in the mean, and no contrast.
    for light in [0, 20] {
        found.add(&image(&DULL, light), &texture(), &maps()).unwrap();
    }
    let found = found.response();
    for k in 0..3 {
        assert!((found.gain[k] - DULL.gain[k]).abs() < 0.01, "{found:?}");
        assert!((found.offset[k] - DULL.offset[k] - 10.0).abs() < 1.0, "{found:?}");
    }
}

#[test]
fn a_registration_that_is_off_leaves_the_contrast_as_it_is() {
    // Three texels off, of fields of seven: least squares would find a gain of a seventh of the true one.
    let mut found = ColorMatch::default();
    let mut off = maps();
    for pixel in (0..5000).filter(|&pixel| maps().inside(pixel)) {
        let [u, v] = maps().registration()[pixel];
        off.set(pixel, 400.0, [(u + 3.0 / 60.0) % 1.0, v]);
    }
    found.add(&image(&DULL, 0), &texture(), &off).unwrap();
    let found = found.response();
    for k in 0..3 {
        assert!((found.gain[k] / DULL.gain[k] - 1.0).abs() < 0.05, "{found:?}");
    }
}

#[test]
fn in_the_cameras_colours_the_exact_registration_has_no_photo_consistency_error() {
    let image = image(&DULL, 0);
    let error = |texture: &Picture| photo_consistency_error(&image, texture, &maps()).unwrap();
    assert!(error(&texture()) > 0.15);
    assert!(error(&DULL.apply(&texture())) < 1e-6);
}

#[test]
fn a_template_without_contrast_keeps_its_gain_and_frames_without_the_object_do_not_count() {
    let grey = Picture::from_fn(60, 40, |x, _| [98 + 4 * (x % 2) as u8; 3]);
    let mut found = ColorMatch::default();
    assert!(found.add(&grey, &grey, &maps()).is_err(), "an image of another size");
    found.add(&image(&DULL, 0), &grey, &Maps::empty((100, 50))).unwrap();
    assert_eq!(found.response(), ColorResponse::IDENTITY);
    // What contrast the picture has is the sensor's noise.
    let noisy = Picture::from_fn(100, 50, |x, y| [if (x + y) % 2 == 0 { 110 } else { 150 }; 3]);
    found.add(&noisy, &grey, &maps()).unwrap();
    let found = found.response();
    assert_eq!(found.gain, [1.0; 3]);
    assert!(
        found.offset.iter().all(|offset| (offset - 30.0).abs() < 1e-3),
        "{found:?}"
    );
    // More contrast than any light makes of a print.
    let pale = Picture::from_fn(60, 40, |x, _| [90 + 20 * (x % 2) as u8; 3]);
    let shown = Picture::from_fn(100, 50, |x, _| [255 * (x % 2) as u8; 3]);
    let mut found = ColorMatch::default();
    found.add(&shown, &pale, &maps()).unwrap();
    assert_eq!(found.response().gain, [3.0; 3]);
}
