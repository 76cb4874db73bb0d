//! Projection, distortion and their inverses.

use deepsft_geometry::Camera;
use deepsft_geometry::glam::{DVec2, DVec3};

#[test]
fn cameras_of_the_paper_are_known_by_name() {
    let kinect = Camera::preset("kinect-v2").unwrap();
    assert_eq!(kinect.size(), (1920, 1080).into());
    assert_eq!(kinect.focal(), DVec2::new(1057.8, 1064.0));
    assert_eq!(kinect.principal_point(), DVec2::new(947.6, 530.4));
    assert!(Camera::preset("realsense-d435").is_some() && Camera::preset("gopro-hero3").is_some());
    assert_eq!(Camera::preset("kinect"), None);
}

#[test]
fn a_focal_length_of_zero_or_nan_is_refused_by_name() {
    for fx in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        let error = Camera::pinhole((640, 480), DVec2::new(fx, 500.0), DVec2::new(320.0, 240.0)).unwrap_err();
        assert!(error.to_string().starts_with("camera fx is"), "{error}");
    }
    let camera = Camera::pinhole((640, 480), DVec2::splat(500.0), DVec2::new(320.0, 240.0)).unwrap();
    assert!(
        camera
            .with_distortion([0.0, f64::NAN, 0.0, 0.0, 0.0])
            .unwrap_err()
            .to_string()
            .contains("k2")
    );
}

#[test]
fn undistorting_a_distorted_ray_gives_it_back() {
    let camera = Camera::pinhole((640, 480), DVec2::new(500.0, 510.0), DVec2::new(322.0, 239.0))
        .unwrap()
        .with_distortion([-0.2, 0.05, 0.001, -0.002, 0.01])
        .unwrap();
    for (x, y) in [(0.0, 0.0), (0.3, -0.2), (-0.5, 0.4)] {
        let ray = DVec2::new(x, y);
        assert!((camera.ray_from_pixel(camera.pixel_from_ray(ray).unwrap()) - ray).length() < 1e-9);
    }
}

#[test]
fn the_gradients_of_the_projection_are_its_finite_differences() {
    let camera = Camera::pinhole((640, 480), DVec2::new(500.0, 510.0), DVec2::new(322.0, 239.0))
        .unwrap()
        .with_distortion([-0.2, 0.05, 0.001, -0.002, 0.01])
        .unwrap();
    for p in [DVec3::new(100.0, -70.0, 400.0), DVec3::new(-150.0, 120.0, 350.0)] {
        let (pixel, gradients) = camera.project_with_gradients(p).unwrap();
        assert_eq!(camera.project(p), Some(pixel));
        for axis in DVec3::AXES {
            // h^2 times the third derivative (1e-6 px / mm^3) plus rounding / h: below 1e-8 px / mm.
            let moved = |by: f64| camera.project(p + by * axis).unwrap();
            let numeric = (moved(1e-2) - moved(-1e-2)) / 2e-2;
            assert!((numeric.x - gradients[0].dot(axis)).abs() < 1e-8);
            assert!((numeric.y - gradients[1].dot(axis)).abs() < 1e-8);
        }
    }
    assert_eq!(camera.project_with_gradients(DVec3::new(0.0, 0.0, -1.0)), None);
}

#[test]
fn distortion_agrees_with_a_hand_computed_opencv_value() {
    // r2 = 0.04 + 0.01 = 0.05; radial = 1 + 0.1 * 0.05 = 1.005;
    // x' = 0.2 * 1.005 + 2 * 0.01 * 0.02 + 0.02 * (0.05 + 0.08) = 0.204
    // y' = 0.1 * 1.005 + 0.01 * (0.05 + 0.02) + 2 * 0.02 * 0.02 = 0.102
    let camera = Camera::pinhole((100, 100), DVec2::splat(100.0), DVec2::splat(50.0))
        .unwrap()
        .with_distortion([0.1, 0.0, 0.01, 0.02, 0.0])
        .unwrap();
    let pixel = camera.pixel_from_ray(DVec2::new(0.2, 0.1)).unwrap();
    assert!((pixel - DVec2::new(70.4, 60.2)).length() < 1e-12, "{pixel}");
}
