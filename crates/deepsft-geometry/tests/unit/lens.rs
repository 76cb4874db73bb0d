//! The two lens models against OpenCV 5.0.0, and their inverses.

use deepsft_geometry::glam::{DVec2, DVec3};
use deepsft_geometry::{Camera, CanonicalWarp, ImageSize, Lens, Picture, training_camera};

/// The camera that the numbers of OpenCV below were made with.
fn pinhole() -> Camera {
    Camera::pinhole((640, 480), DVec2::new(612.5, 608.75), DVec2::new(321.25, 242.5)).unwrap()
}

fn polynomial() -> Camera {
    pinhole()
        .with_distortion([-0.21, 0.062, 0.0011, -0.0017, -0.004])
        .unwrap()
}

fn fisheye() -> Camera {
    pinhole().with_fisheye([0.043, -0.017, 0.0062, -0.0011]).unwrap()
}

/// A lens of 170 degrees from corner to corner, and an ordinary wide one whose polynomial just serves the corners.
fn wide() -> [Camera; 2] {
    [
        Camera::pinhole((1280, 960), DVec2::new(520.0, 521.0), DVec2::new(636.0, 482.0))
            .unwrap()
            .with_fisheye([0.02, -0.01, 0.004, -0.0012])
            .unwrap(),
        Camera::pinhole((1280, 960), DVec2::new(700.0, 702.0), DVec2::new(645.0, 476.0))
            .unwrap()
            .with_distortion([-0.3, 0.11, 0.0008, -0.0006, -0.01])
            .unwrap(),
    ]
}

type Pairs<const N: usize> = [([f64; 2], [f64; 2]); N];

#[test]
fn rays_go_where_opencv_says() {
    // `cv2.projectPoints` and `cv2.fisheye.projectPoints`.
    let ordinary: Pairs<6> = [
        ([0.0, 0.0], [321.250000000, 242.500000000]),
        ([0.3, -0.2], [499.770905955, 124.212081539]),
        ([-0.5, 0.4], [37.043716975, 468.408102896]),
        ([0.7, 0.35], [703.102490947, 432.984385058]),
        ([-0.05, -0.6], [292.370421392, -97.188733029]),
        ([1.2, -0.7], [900.822052920, -93.386517868]),
    ];
    let round: Pairs<6> = [
        ([0.0, 0.0], [321.250000000, 242.500000000]),
        ([0.3, -0.2], [498.473113015, 125.074617635]),
        ([-0.5, 0.4], [45.485196275, 461.761158227]),
        ([0.7, 0.35], [690.917782584, 426.202255223]),
        ([-0.05, -0.6], [293.371831650, -89.989828243]),
        ([1.2, -0.7], [836.569034712, -56.262345125]),
    ];
    for (camera, pairs) in [(polynomial(), ordinary), (fisheye(), round)] {
        for (ray, pixel) in pairs {
            let ours = camera.pixel_from_ray(ray.into()).unwrap();
            assert!(
                (ours - DVec2::from(pixel)).length() < 1e-6,
                "{:?} {ray:?}: {ours}",
                camera.lens()
            );
        }
    }
}

#[test]
fn pixels_come_from_where_opencv_says() {
    // `cv2.undistortPoints` and `cv2.fisheye.undistortPoints`, with 200 iterations.
    let pixels = [
        [20.0, 15.0],
        [620.0, 30.0],
        [321.25, 242.5],
        [10.0, 470.0],
        [400.0, 100.0],
    ];
    let ordinary = [
        [-0.534761643, -0.407509981],
        [0.531777061, -0.380527256],
        [0.0, 0.0],
        [-0.553222226, 0.406931435],
        [0.130805593, -0.238004355],
    ];
    let round = [
        [-0.555589130, -0.422158176],
        [0.546800486, -0.391333504],
        [0.0, 0.0],
        [-0.577344668, 0.424594456],
        [0.131309563, -0.239071484],
    ];
    for (camera, rays) in [(polynomial(), ordinary), (fisheye(), round)] {
        for (pixel, ray) in pixels.into_iter().zip(rays) {
            let ours = camera.ray_from_pixel(pixel.into());
            assert!(
                (ours - DVec2::from(ray)).length() < 1e-6,
                "{:?} {pixel:?}: {ours}",
                camera.lens()
            );
        }
    }
}

#[test]
fn every_pixel_comes_back_to_itself_up_to_the_corners_of_wide_lenses() {
    for camera in [polynomial(), fisheye()].into_iter().chain(wide()) {
        let ImageSize { width, height } = camera.size();
        for y in (0..=height).step_by(8) {
            for x in (0..=width).step_by(8) {
                let pixel = DVec2::new(x as f64, y as f64);
                let back = camera.pixel_from_ray(camera.ray_from_pixel(pixel)).unwrap();
                assert!(back.distance(pixel) < 1e-8, "{:?} {pixel}: {back}", camera.lens());
            }
        }
    }
}

#[test]
fn gradients_are_finite_differences_for_both_lenses() {
    for camera in [polynomial(), fisheye()] {
        for p in [
            DVec3::new(100.0, -70.0, 400.0),
            DVec3::new(-450.0, 420.0, 350.0),
            DVec3::new(0.0, 0.0, 300.0),
        ] {
            let (pixel, gradients) = camera.project_with_gradients(p).unwrap();
            assert_eq!(camera.project(p), Some(pixel));
            for axis in DVec3::AXES {
                let moved = |by: f64| camera.project(p + by * axis).unwrap();
                let numeric = (moved(1e-2) - moved(-1e-2)) / 2e-2;
                assert!(
                    (numeric.x - gradients[0].dot(axis)).abs() < 1e-8,
                    "{:?} {p}",
                    camera.lens()
                );
                assert!(
                    (numeric.y - gradients[1].dot(axis)).abs() < 1e-8,
                    "{:?} {p}",
                    camera.lens()
                );
            }
        }
    }
}

/// r (1 - 0.3 r^2) is largest at r = sqrt(1 / 0.9): from there on the model would bring outer rays back into the image.
#[test]
fn rays_beyond_the_fold_of_the_model_have_no_pixel() {
    let camera = Camera::pinhole((640, 480), DVec2::splat(300.0), DVec2::new(320.0, 240.0))
        .unwrap()
        .with_distortion([-0.3, 0.0, 0.0, 0.0, 0.0])
        .unwrap();
    let fold = (1.0 / 0.9_f64).sqrt();
    let on_x = |r: f64| camera.pixel_from_ray(DVec2::new(r, 0.0));
    assert!(on_x(fold - 1e-9).is_some());
    assert_eq!(on_x(fold + 1e-9), None);
    assert_eq!(camera.project(DVec3::new(20.0, 0.0, 10.0)), None);
    // Nothing lands farther out than 300 * 2 / 3 * fold = 210.8 px from the centre; the image's edge is 320 px away.
    let outermost = camera.ray_from_pixel(DVec2::new(640.0, 240.0));
    assert!((outermost - DVec2::new(fold, 0.0)).length() < 1e-9, "{outermost}");
    let corner = camera.ray_from_pixel(DVec2::ZERO);
    assert!((corner.length() - fold).abs() < 1e-9 && corner.x < 0.0 && corner.y < 0.0);
    // The canonical image of such a camera shows everything once: white only where white is.
    let white_rim = Picture::from_fn(640, 480, |x, y| {
        let from_centre = DVec2::new(x as f64 + 0.5 - 320.0, y as f64 + 0.5 - 240.0).length();
        [if from_centre > 190.0 { 255 } else { 60 }; 3]
    });
    let narrow = Camera::pinhole((300, 300), DVec2::splat(100.0), DVec2::splat(150.0)).unwrap();
    let warped = CanonicalWarp::new(&camera, &narrow).apply(&white_rim).unwrap();
    assert_eq!(warped.pixel(150, 150), [60; 3]);
    assert_eq!(warped.pixel(299, 150), [0; 3]);
    assert_eq!(warped.pixel(0, 0), [0; 3]);
}

#[test]
fn a_fisheye_turns_and_shrinks_with_its_image() {
    let camera = fisheye();
    let point = DVec3::new(40.0, 25.0, 60.0);
    let pixel = camera.project(point).unwrap();
    let turned = camera.turned_anticlockwise();
    let seen = turned.project(DVec3::new(point.y, -point.x, point.z)).unwrap();
    assert!((seen - DVec2::new(pixel.y, 640.0 - pixel.x)).length() < 1e-9);
    let half = camera.resized((320, 240)).unwrap();
    assert!((half.project(point).unwrap() - pixel / 2.0).length() < 1e-9);
    assert_eq!(half.lens(), camera.lens());
}

/// What a fisheye sees of a plane of stripes, warped, has its stripes where the canonical camera sees them.
#[test]
fn the_canonical_image_of_a_fisheye_has_straight_lines() {
    let camera = wide()[0];
    let stripe = |x: f64| if (x * 10.0).floor() as i64 % 2 == 0 { 200 } else { 40 };
    let source = Picture::from_fn(1280, 960, |x, y| {
        [stripe(camera.ray_from_pixel(DVec2::new(x as f64 + 0.5, y as f64 + 0.5)).x); 3]
    });
    let canonical = training_camera();
    let warped = CanonicalWarp::new(&camera, &canonical).apply(&source).unwrap();
    for y in [2, 135, 267] {
        for x in 0..480 {
            let at = canonical.ray_from_pixel(DVec2::new(x as f64 + 0.5, y as f64 + 0.5)).x * 10.0;
            if (at - at.round()).abs() > 0.06 {
                assert_eq!(warped.pixel(x, y)[0], stripe(at / 10.0), "({x}, {y})");
            }
        }
    }
}

#[test]
fn a_lens_without_coefficients_is_none_unless_it_is_a_fisheye() {
    assert_eq!(pinhole().with_distortion([0.0; 5]).unwrap().lens(), Lens::Pinhole);
    let equidistant = pinhole().with_fisheye([0.0; 4]).unwrap();
    let pixel = equidistant.pixel_from_ray(DVec2::new(1.0, 0.0)).unwrap();
    assert!((pixel.x - (321.25 + 612.5 * std::f64::consts::FRAC_PI_4)).abs() < 1e-9);
    let error = pinhole()
        .with_fisheye([0.0, f64::NAN, 0.0, 0.0])
        .unwrap_err()
        .to_string();
    assert!(error.contains("k2"), "{error}");
}
