//! The canonical warp.

use deepsft_geometry::glam::{DVec2, DVec3};
use deepsft_geometry::{Camera, CanonicalWarp, Picture, canonical_camera, training_camera};

fn noise(width: usize, height: usize) -> Picture {
    let mut state = 7_u32;
    Picture::from_fn(width, height, |_, _| {
        std::array::from_fn(|_| {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (state >> 24) as u8
        })
    })
}

#[test]
fn the_training_camera_itself_copies_every_pixel() {
    let camera = training_camera();
    let picture = noise(480, 270);
    assert_eq!(CanonicalWarp::new(&camera, &camera).apply(&picture).unwrap(), picture);
}

#[test]
fn a_camera_twice_as_fine_gives_the_mean_of_two_by_two_pixels() {
    let camera = training_camera();
    let source = camera.resized((960, 540)).unwrap();
    let picture = noise(960, 540);
    let warped = CanonicalWarp::new(&source, &camera).apply(&picture).unwrap();
    for (x, y) in [(0, 0), (479, 269), (17, 200)] {
        for k in 0..3 {
            let sum: u32 = [(0, 0), (1, 0), (0, 1), (1, 1)]
                .iter()
                .map(|(i, j)| u32::from(picture.pixel(2 * x + i, 2 * y + j)[k]))
                .sum();
            assert_eq!(u32::from(warped.pixel(x, y)[k]), (sum + 2) / 4, "pixel ({x}, {y})");
        }
    }
}

#[test]
fn a_cropped_image_is_padded_and_keeps_its_pixels() {
    let camera = training_camera();
    let source = Camera::pinhole((300, 200), DVec2::splat(380.0), DVec2::new(240.0 - 100.0, 135.0 - 30.0)).unwrap();
    let picture = noise(300, 200);
    let warped = CanonicalWarp::new(&source, &camera).apply(&picture).unwrap();
    assert_eq!(warped.pixel(100, 30), picture.pixel(0, 0));
    assert_eq!(warped.pixel(399, 229), picture.pixel(299, 199));
    assert_eq!(warped.pixel(99, 30), [0; 3]);
    assert_eq!(warped.pixel(400, 100), [0; 3]);
}

#[test]
fn sums_over_columns_and_rows_are_the_mean_of_all_samples() {
    for (width, height, f, cx, cy) in [
        (1280, 720, 1010.0, 650.0, 355.0),
        (321, 243, 190.0, 170.0, 100.0),
        (200, 100, 700.0, -40.0, 60.0),
        (97, 1, 380.0, 40.0, 0.5),
    ] {
        let source = Camera::pinhole((width, height), DVec2::new(f, f * 1.1), DVec2::new(cx, cy)).unwrap();
        let picture = noise(width, height);
        let warped = |source| CanonicalWarp::new(source, &training_camera()).apply(&picture).unwrap();
        // A lens that distorts nothing, because 1 + 1e-300 is 1, but is not one without distortion.
        let lens = source.with_distortion([1e-300, 0.0, 0.0, 0.0, 0.0]).unwrap();
        let (fast, plain) = (warped(&source), warped(&lens));
        // Rounding of a mean that falls half way between two levels may differ.
        assert!(
            fast.rgb().iter().zip(plain.rgb()).all(|(a, b)| a.abs_diff(*b) <= 1),
            "{width} x {height}"
        );
        let equal = fast.rgb().iter().zip(plain.rgb()).filter(|(a, b)| a == b).count();
        assert!(
            equal as f64 > 0.999 * plain.rgb().len() as f64,
            "{width} x {height}: {equal}"
        );
        assert!(plain.rgb().iter().any(|&v| v > 0));
    }
}

#[test]
fn upright_images_have_an_upright_canonical_image() {
    let training = training_camera();
    for size in [(1280, 720), (480, 270), (500, 500)] {
        assert_eq!(canonical_camera(&training, size), training);
    }
    let upright = canonical_camera(&training, (720, 1280));
    assert_eq!(upright.size(), (270, 480).into());
    assert_eq!(
        (upright.focal(), upright.principal_point()),
        (training.focal(), DVec2::new(135.0, 240.0))
    );
    assert_eq!(canonical_camera(&upright, (720, 1280)), upright);
}

/// What a turned camera sees is the turned image of what the camera saw, its lens included.
#[test]
fn a_turned_camera_sees_a_turned_image() {
    let camera = Camera::pinhole((640, 360), DVec2::new(500.0, 510.0), DVec2::new(300.0, 190.0))
        .unwrap()
        .with_distortion([0.1, -0.05, 0.003, -0.002, 0.01])
        .unwrap();
    let turned = camera.turned_anticlockwise();
    for point in [DVec3::new(40.0, 25.0, 300.0), DVec3::new(-70.0, 31.0, 250.0)] {
        let pixel = camera.project(point).unwrap();
        let seen = turned.project(DVec3::new(point.y, -point.x, point.z)).unwrap();
        assert!(
            (seen - DVec2::new(pixel.y, 640.0 - pixel.x)).length() < 1e-9,
            "{pixel} {seen}"
        );
    }
    let picture = noise(9, 4);
    let mut back = picture.turned_clockwise();
    assert_eq!((back.size(), back.pixel(3, 0)), ((4, 9).into(), picture.pixel(0, 0)));
    for _ in 0..3 {
        back = back.turned_clockwise();
    }
    assert_eq!(back, picture);
}
