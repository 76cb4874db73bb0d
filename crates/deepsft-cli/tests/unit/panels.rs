//! What panels show of maps.

use crate::output::color_map::ColorMap;
use crate::output::panels::{
    average, coordinate, depth, depth_error, overlay, photometric_difference, registration_error_px,
};
use deepsft_geometry::glam::DVec2;
use deepsft_geometry::{Camera, Maps, Picture};

/// Colour of pixels without a value.
const NOTHING: [u8; 3] = [48, 48, 54];

const SIZE: DVec2 = DVec2::new(200.0, 100.0);

/// The left half of 200 x 100 pixels sees the left half of the sheet, one texel a pixel.
fn half() -> Maps {
    let mut maps = Maps::empty((200, 100));
    for y in 0..100 {
        for x in 0..100 {
            maps.set(
                y * 200 + x,
                400.0 + x as f32,
                [(x as f32 + 0.5) / 200.0, (y as f32 + 0.5) / 100.0],
            );
        }
    }
    maps
}

#[test]
fn a_dimmed_and_tinted_photograph_of_the_template_shows_no_difference() {
    let texture = Picture::from_fn(200, 100, |x, y| [(x % 16 * 10) as u8, (y % 16 * 10) as u8, 100]);
    let image = Picture::from_fn(200, 100, |x, y| {
        let [r, g, b] = texture.pixel(x, y);
        [r / 2 + 20, g, b / 2]
    });
    let panel = photometric_difference("", &image, &texture, &half());
    // Halving loses half a level: at most half of 1/100 of the scale, so the first colours of the map.
    assert!(
        panel.picture.pixel(50, 50).iter().all(|&c| c < 8),
        "{:?}",
        panel.picture.pixel(50, 50)
    );
    assert_eq!(panel.picture.pixel(150, 50), NOTHING);
}

#[test]
fn the_checkerboard_has_six_squares_along_the_short_side() {
    let panel = overlay("", &Picture::from_fn(200, 100, |_, _| [0; 3]), &half(), SIZE);
    let column: Vec<bool> = (0..100).map(|y| panel.picture.pixel(3, y) == [127; 3]).collect();
    assert_eq!(column.windows(2).filter(|pair| pair[0] != pair[1]).count(), 5);
    assert_eq!(panel.picture.pixel(150, 50), [0; 3]);
}

#[test]
fn the_depth_scale_leaves_out_the_outermost_percents() {
    let bar = depth("", &half()).bar.unwrap();
    assert_eq!(bar.range, [402.0, 498.0]);
    assert_eq!(depth("", &Maps::empty((4, 4))).bar.unwrap().range, [0.0, 1.0]);
}

#[test]
fn the_depth_error_is_in_millimetres() {
    let truth = half();
    let mut predicted = truth.clone();
    predicted.set(0, truth.depth()[0] + 5.0, truth.registration()[0]);
    let depth = depth_error("", &predicted, &truth, 10.0);
    assert_eq!(depth.picture.pixel(0, 0), ColorMap::Inferno.color(0.5));
    assert_eq!(depth.picture.pixel(1, 0), ColorMap::Inferno.color(0.0));
}

#[test]
fn the_registration_error_in_pixels_is_that_of_the_metrics() {
    // At 380 mm a pixel is 1 mm for f = 380, so 200 x 100 mm fill 200 x 100 pixels; 3 px and 4 px off.
    let camera = Camera::pinhole((200, 100), DVec2::splat(380.0), DVec2::new(100.0, 50.0)).unwrap();
    let (mut truth, mut predicted) = (Maps::empty((200, 100)), Maps::empty((200, 100)));
    for pixel in 0..200 * 100 {
        let uv = [(pixel % 200) as f32 + 0.5, (pixel / 200) as f32 + 0.5];
        truth.set(pixel, 380.0, [uv[0] / 200.0, uv[1] / 100.0]);
        predicted.set(pixel, 380.0, [(uv[0] + 3.0) / 200.0, (uv[1] + 4.0) / 100.0]);
    }
    let panel = registration_error_px("", &predicted, &truth, &camera, SIZE.into(), 10.0);
    let difference = |a: [u8; 3], b: [u8; 3]| (0..3).map(|k| a[k].abs_diff(b[k])).max().unwrap();
    assert!(difference(panel.picture.pixel(50, 50), ColorMap::Inferno.color(0.5)) <= 1);
    assert_eq!(
        panel.picture.pixel(0, 0),
        NOTHING,
        "a pixel at the border lacks neighbours"
    );
}

#[test]
fn coordinates_go_over_the_whole_ramp_and_the_average_is_half_of_each() {
    let maps = half();
    let v = coordinate("", &maps, 1).picture;
    assert_eq!(v.pixel(7, 0), ColorMap::Viridis.color(0.005));
    assert_eq!(v.pixel(7, 99), ColorMap::Viridis.color(0.995));
    assert_eq!(v.pixel(150, 50), NOTHING);
    let [image, texture] = [[40; 3], [100; 3]].map(|color| Picture::from_fn(200, 100, |_, _| color));
    let average = average("", &image, &texture, &maps).picture;
    assert_eq!((average.pixel(50, 50), average.pixel(150, 50)), ([70; 3], [20; 3]));
}
