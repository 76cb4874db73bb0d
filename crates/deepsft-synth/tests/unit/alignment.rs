//! Depth of one camera in the image of another.

use crate::recording::RgbdSensor;
use crate::recording::alignment::DepthAlignment;
use deepsft_geometry::glam::{DAffine3, DVec3};
use deepsft_geometry::training_camera;

/// A depth picture of `sensor`, in its units.
fn picture(sensor: &RgbdSensor, depth_mm: impl Fn(f64, f64) -> f64) -> Vec<u16> {
    let (width, height) = (sensor.depth.size().width, sensor.depth.size().height);
    let at = |i: usize| ((i % width) as f64 + 0.5, (i / width) as f64 + 0.5);
    (0..width * height)
        .map(|i| {
            let (x, y) = at(i);
            (depth_mm(x, y) / 1000.0 * sensor.depth_scale).round() as u16
        })
        .collect()
}

#[test]
fn depth_of_the_target_camera_itself_is_copied_and_holes_stay() {
    let sensor = RgbdSensor::registered(training_camera());
    let mut raw = picture(&sensor, |x, y| 500.0 + x.floor() + y.floor());
    raw[7] = 0;
    let aligned = DepthAlignment::new(&sensor, &training_camera()).apply(&raw);
    assert!(aligned.iter().zip(&raw).all(|(&a, &r)| a == f32::from(r)));
    assert_eq!(aligned[7], 0.0);
}

#[test]
fn four_times_as_fine_a_picture_is_averaged_over_the_surface_that_is_seen() {
    let color = training_camera().resized((1920, 1080)).unwrap();
    let sensor = RgbdSensor {
        depth_scale: 5000.0,
        ..RgbdSensor::registered(color)
    };
    // 600 mm with noise of +-5 in turns; the left half of the image holds a post at 400 mm in every fourth column.
    let raw = picture(&sensor, |x, y| match (x as u32, y as u32) {
        (x, _) if x < 960 && x % 4 == 0 => 400.0,
        (x, y) => 600.0 + if (x + y).is_multiple_of(2) { 5.0 } else { -5.0 },
    });
    let aligned = DepthAlignment::new(&sensor, &training_camera()).apply(&raw);
    assert!(
        (aligned[100 * 480 + 100] - 400.0).abs() < 1e-3,
        "the nearest surface wins"
    );
    assert!((aligned[100 * 480 + 400] - 600.0).abs() < 1e-3, "noise is averaged");
    assert!(aligned.iter().all(|&d| d > 0.0), "no holes");
}

#[test]
fn a_depth_camera_beside_sees_the_same_plane_and_leaves_a_hole_where_it_cannot_look() {
    // The depth camera is 50 mm to the right, half as fine. A wall at 800 mm, a screen at 400 mm before it in the
    // colour image's columns 240 to 300: X from 0 to 60 * 400 / 380 mm.
    let depth = training_camera().resized((240, 135)).unwrap();
    let sensor = RgbdSensor {
        depth,
        color_from_depth: DAffine3::from_translation(DVec3::new(50.0, 0.0, 0.0)),
        ..RgbdSensor::registered(training_camera())
    };
    let right = 60.0 * 400.0 / 380.0;
    let raw = picture(&sensor, |x, _| {
        let ray = (x - 120.0) / 190.0;
        let at_screen = ray * 400.0 + 50.0;
        if (0.0..right).contains(&at_screen) {
            400.0
        } else {
            800.0
        }
    });
    let aligned = DepthAlignment::new(&sensor, &training_camera()).apply(&raw);
    let row = &aligned[135 * 480..136 * 480];
    // Squares are two pixels wide in the target: the edges are right to one of them.
    assert!(row[243..297].iter().all(|&d| d == 400.0), "{:?}", &row[235..305]);
    assert!(row[304..400].iter().all(|&d| d == 800.0));
    // The depth camera sees the wall left of the screen's left edge from x = 50 mm: the line through (0, 400) meets
    // the wall at X = -50, which is 50 / 800 * 380 = 24 px left of the colour image's middle.
    assert!(row[219..237].iter().all(|&d| d == 0.0), "{:?}", &row[210..245]);
    assert!(row[100..213].iter().all(|&d| d == 800.0));
}

#[test]
fn a_pose_that_puts_the_wall_at_the_pinhole_gives_holes_and_no_wall() {
    // A wall at 800 mm, and a depth camera said to stand 799.9 mm behind the target: at 0.1 mm a square is 8000 pixels wide.
    let sensor = RgbdSensor {
        color_from_depth: DAffine3::from_translation(DVec3::new(0.0, 0.0, -799.9)),
        ..RgbdSensor::registered(training_camera())
    };
    let raw = picture(&sensor, |_, _| 800.0);
    let aligned = DepthAlignment::new(&sensor, &training_camera()).apply(&raw);
    assert!(aligned.iter().all(|&depth| depth == 0.0));
}
