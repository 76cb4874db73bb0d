//! The template seen through the registration, against the image.

use deepsft_geometry::{Maps, Picture, draw_template, photo_consistency_error, relit_photo_consistency_error};

/// One texel of a 200 x 100 texture per pixel: texel (x, y) is seen at pixel (x + 100, y + 50).
fn frontal(shift_px: f32) -> Maps {
    let mut maps = Maps::empty((480, 270));
    for y in 0..100 {
        for x in 0..200 {
            let uv = [(x as f32 + 0.5 + shift_px) / 200.0, (y as f32 + 0.5) / 100.0];
            maps.set((y + 50) * 480 + x + 100, 380.0, uv);
        }
    }
    maps
}

#[test]
fn the_photo_consistency_error_of_a_grey_that_is_51_levels_off_is_one_fifth() {
    let image = Picture::from_fn(480, 270, |_, _| [151; 3]);
    let texture = Picture::from_fn(20, 10, |_, _| [100; 3]);
    assert!((photo_consistency_error(&image, &texture, &frontal(0.0)).unwrap() - 0.2).abs() < 1e-6);
    assert_eq!(
        photo_consistency_error(&image, &texture, &Maps::empty((480, 270))),
        None
    );
    assert_eq!(
        photo_consistency_error(&texture, &texture, &frontal(0.0)),
        None,
        "an image of another size"
    );
}

#[test]
fn a_picture_drawn_through_the_registration_has_no_photo_consistency_error() {
    let color = |x: usize, y: usize| [(x % 7 * 30) as u8, (y % 5 * 50) as u8, ((x + y) % 3 * 80) as u8];
    let texture = Picture::from_fn(200, 100, color);
    let drawn = draw_template(&texture, &frontal(0.0));
    assert_eq!((drawn.width(), drawn.height()), (480, 270));
    assert_eq!(
        [drawn.pixel(100, 50), drawn.pixel(299, 149)],
        [color(0, 0), color(199, 99)]
    );
    assert_eq!([drawn.pixel(99, 50), drawn.pixel(300, 149)], [[0; 3]; 2]);
    assert!(
        photo_consistency_error(&drawn, &texture, &frontal(0.0)).unwrap() < 1e-5,
        "bilinear weights are f32"
    );
    assert!(
        photo_consistency_error(&drawn, &texture, &frontal(1.0)).unwrap() > 0.1,
        "a shift of a pixel is seen"
    );
}

#[test]
fn light_that_is_the_same_all_over_is_taken_away_and_a_shift_is_not() {
    let color = |x: usize, y: usize| [(x % 7 * 30) as u8, (y % 5 * 50) as u8, ((x + y) % 3 * 80) as u8];
    let texture = Picture::from_fn(200, 100, color);
    let lit = draw_template(&texture, &frontal(0.0));
    let lit = Picture::from_fn(480, 270, |x, y| lit.pixel(x, y).map(|c| c / 2 + 40));
    assert!(photo_consistency_error(&lit, &texture, &frontal(0.0)).unwrap() > 0.05);
    // Halving rounds by half a level at most.
    assert!(relit_photo_consistency_error(&lit, &texture, &frontal(0.0)).unwrap() < 0.5 / 255.0);
    assert!(relit_photo_consistency_error(&lit, &texture, &frontal(1.0)).unwrap() > 0.05);
    assert_eq!(
        relit_photo_consistency_error(&lit, &texture, &Maps::empty((480, 270))),
        None
    );
}

#[test]
fn a_texture_finer_than_the_image_is_averaged() {
    // Four texels along each side of a pixel, a checkerboard: every pixel sees grey.
    let texture = Picture::from_fn(800, 400, |x, y| [if (x + y) % 2 == 0 { 0 } else { 200 }; 3]);
    let image = Picture::from_fn(480, 270, |_, _| [100; 3]);
    assert!(
        photo_consistency_error(&image, &texture, &frontal(0.0)).unwrap() < 1e-6,
        "bilinear weights are f32"
    );
}
