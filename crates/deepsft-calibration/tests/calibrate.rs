//! Calibration with a flat target: against OpenCV 5.0.0 on the same points, and against the truth.

#![allow(clippy::unwrap_used, clippy::panic)]

use deepsft_calibration::{Calibration, CalibrationError, CameraModel, Correspondence, calibrate};
use deepsft_geometry::glam::{DQuat, DVec2, DVec3};
use deepsft_geometry::{Camera, ImageSize};

const SIZE: ImageSize = ImageSize {
    width: 1280,
    height: 720,
};

/// Rotation vectors and translations (mm) from a board of 7 x 5 points, 30 mm apart, to the camera.
const POSES: [([f64; 3], [f64; 3]); 6] = [
    ([0.35, -0.25, 0.1], [-95.0, -70.0, 420.0]),
    ([-0.4, 0.3, -0.2], [-120.0, -60.0, 380.0]),
    ([0.1, 0.5, 0.3], [-60.0, -110.0, 450.0]),
    ([-0.3, -0.45, 0.05], [-130.0, -90.0, 400.0]),
    ([0.5, 0.05, -0.35], [-70.0, -40.0, 350.0]),
    ([0.02, -0.1, 0.7], [-20.0, -140.0, 390.0]),
];

fn ordinary() -> Camera {
    Camera::pinhole(SIZE, DVec2::new(905.0, 911.0), DVec2::new(633.0, 367.0)).unwrap()
}

fn distorting() -> Camera {
    ordinary().with_distortion([-0.14, 0.06, 0.0008, -0.0011, 0.0]).unwrap()
}

fn fisheye() -> Camera {
    ordinary().with_fisheye([0.031, -0.012, 0.004, -0.001]).unwrap()
}

/// What `camera` sees of the board, moved by up to `noise_px` in a way that another program can repeat.
fn views(camera: &Camera, poses: &[([f64; 3], [f64; 3])], noise_px: f64) -> Vec<Vec<Correspondence>> {
    let view = |(view, &(turn, shift)): (usize, &([f64; 3], [f64; 3]))| {
        let point = |i: usize| {
            let place_mm = 30.0 * DVec2::new((i % 7) as f64, (i / 7) as f64);
            let p_camera = DQuat::from_scaled_axis(DVec3::from(turn)) * place_mm.extend(0.0) + DVec3::from(shift);
            let angle = 12.9898 * i as f64 + 78.233 * view as f64;
            let noise = noise_px * DVec2::new((3.1 * angle).sin(), (5.7 * angle + 1.0).sin());
            let pixel = camera.project(p_camera).unwrap() + noise;
            Correspondence { place_mm, pixel }
        };
        (0..35).map(point).collect()
    };
    poses.iter().enumerate().map(view).collect()
}

fn value(found: &Calibration, name: &str) -> (f64, f64) {
    let parameter = found.parameters.iter().find(|p| p.name == name).unwrap();
    (parameter.value, parameter.standard_deviation)
}

#[test]
fn camera_and_deviations_are_those_of_opencv() {
    // cv2.calibrateCameraExtended on the same points.
    let found = calibrate(&views(&distorting(), &POSES, 0.25), SIZE, Some(CameraModel::Polynomial)).unwrap();
    assert!((found.rms_px - 0.24780645876).abs() < 1e-6, "{}", found.rms_px);
    for (name, expected, deviation) in [
        ("fx", 905.94724638, 1.60228148),
        ("fy", 911.67044812, 1.59012427),
        ("cx", 632.63460771, 2.14361868),
        ("cy", 365.68273504, 1.71630444),
        ("k1", -0.14045227, 0.01695785),
        ("k2", 0.05291789, 0.21317671),
        ("p1", 0.00022541, 0.00050847),
        ("p2", -0.00127212, 0.00052474),
        ("k3", 0.06633836, 0.79638272),
    ] {
        let (value, own_deviation) = value(&found, name);
        assert!((value - expected).abs() < 1e-3 * deviation, "{name} {value} {expected}");
        assert!(
            (own_deviation / deviation - 1.0).abs() < 1e-3,
            "{name} {own_deviation} {deviation}"
        );
    }
    let radial = calibrate(&views(&distorting(), &POSES, 0.25), SIZE, Some(CameraModel::Radial)).unwrap();
    for (name, expected) in [
        ("fx", 905.44625680),
        ("cx", 637.16902083),
        ("k1", -0.14116686),
        ("k2", 0.06762726),
    ] {
        let (value, deviation) = value(&radial, name);
        assert!((value - expected).abs() < 1e-3 * deviation, "{name} {value} {expected}");
    }
}

#[test]
fn a_fisheye_is_that_of_opencv() {
    // cv2.fisheye.calibrate on the same points: the focal lengths are held, the coefficients hardly.
    let found = calibrate(&views(&fisheye(), &POSES, 0.25), SIZE, Some(CameraModel::Fisheye)).unwrap();
    assert!((found.rms_px - 0.24805284322).abs() < 1e-6, "{}", found.rms_px);
    for (name, expected) in [
        ("fx", 906.16042849),
        ("fy", 911.95019133),
        ("cx", 632.55333393),
        ("k1", 0.01611822),
    ] {
        let (value, deviation) = value(&found, name);
        assert!((value - expected).abs() < 1e-2 * deviation, "{name} {value} {expected}");
    }
}

#[test]
fn exact_points_give_the_exact_camera_of_every_model() {
    let centred = Camera::pinhole(SIZE, DVec2::splat(900.0), DVec2::new(640.0, 360.0)).unwrap();
    let wide = Camera::pinhole(SIZE, DVec2::new(380.0, 382.0), DVec2::new(633.0, 367.0))
        .unwrap()
        .with_fisheye([0.03, -0.01, 0.003, -0.001])
        .unwrap();
    let telephoto = Camera::pinhole(SIZE, DVec2::splat(4000.0), DVec2::new(640.0, 360.0)).unwrap();
    let far = POSES.map(|(turn, [x, y, z])| (turn, [x, y, 4.0 * z]));
    for (camera, model, poses) in [
        (centred, CameraModel::Focal, POSES),
        (ordinary(), CameraModel::Pinhole, POSES),
        (distorting(), CameraModel::Polynomial, POSES),
        (wide, CameraModel::Fisheye, POSES),
        (telephoto, CameraModel::Focal, far),
    ] {
        let found = calibrate(&views(&camera, &poses, 0.0), SIZE, Some(model)).unwrap();
        assert!(found.rms_px < 1e-6, "{model:?} {}", found.rms_px);
        assert!(
            (found.camera.focal() - camera.focal()).length() < 1e-4,
            "{model:?} {:?}",
            found.camera
        );
        assert!(
            (found.camera.principal_point() - camera.principal_point()).length() < 1e-4,
            "{model:?}"
        );
    }
    let [view, ..] = &views(&centred, &POSES, 0.0)[..] else {
        panic!()
    };
    let one = calibrate(std::slice::from_ref(view), SIZE, Some(CameraModel::Focal)).unwrap();
    assert!((one.camera.focal().x - 900.0).abs() < 1e-4);
}

#[test]
fn the_model_with_the_fewest_parameters_that_explains_the_views_is_chosen() {
    let centred = Camera::pinhole(SIZE, DVec2::splat(900.0), DVec2::new(640.0, 360.0)).unwrap();
    for (camera, model) in [
        (centred, CameraModel::Focal),
        (ordinary(), CameraModel::Pinhole),
        (
            ordinary().with_distortion([-0.14, 0.06, 0.0, 0.0, 0.0]).unwrap(),
            CameraModel::Radial,
        ),
        (
            ordinary().with_distortion([-0.14, 0.06, 0.008, -0.009, 0.0]).unwrap(),
            CameraModel::Polynomial,
        ),
    ] {
        assert_eq!(
            calibrate(&views(&camera, &POSES, 0.25), SIZE, None).unwrap().model,
            model
        );
    }
}

#[test]
fn points_that_are_wrong_are_left_out() {
    let mut views = views(&distorting(), &POSES, 0.1);
    for (view, point, shift) in [(0, 3, 13.0), (2, 17, 4.0), (2, 30, -60.0), (5, 0, 250.0)] {
        views[view][point].pixel.x += shift;
    }
    let found = calibrate(&views, SIZE, Some(CameraModel::Radial)).unwrap();
    let left_out: Vec<_> = (0..6)
        .flat_map(|view| (0..35).map(move |point| (view, point)))
        .filter(|&(view, point)| found.views[view].residuals_px[point].is_none())
        .collect();
    assert_eq!(left_out, [(0, 3), (2, 17), (2, 30), (5, 0)]);
    assert!((found.camera.focal().x / 905.0 - 1.0).abs() < 2e-3 && found.rms_px < 0.15);
}

#[test]
fn a_view_that_cannot_be_used_is_left_out_and_the_others_give_the_camera() {
    let good = views(&distorting(), &POSES, 0.1);
    // All but five points are found elsewhere, each in another direction.
    let mut scattered = good[2].clone();
    for (i, point) in scattered.iter_mut().enumerate().skip(5) {
        point.pixel += 100.0 * DVec2::from_angle(2.4 * i as f64);
    }
    // Five points are too few, and points on a line have no pose.
    let few = good[2][..5].to_vec();
    let line = good[2][..7].to_vec();
    let without = [&good[..2], &good[3..]].concat();
    for model in [Some(CameraModel::Radial), None] {
        let expected = calibrate(&without, SIZE, model).unwrap();
        for bad in [&scattered, &few, &line, &Vec::new()] {
            let mut all = good.clone();
            all[2] = bad.clone();
            let found = calibrate(&all, SIZE, model).unwrap();
            assert_eq!((found.model, found.used_views()), (expected.model, 5));
            assert!((found.camera.focal() - expected.camera.focal()).length() < 1e-3);
            assert_eq!(found.views[2].rms_px, None);
            assert_eq!(found.views[2].residuals_px, vec![None; bad.len()]);
            assert!(
                found
                    .views
                    .iter()
                    .enumerate()
                    .all(|(i, view)| i == 2 || view.rms_px.is_some_and(|rms| rms < 0.15))
            );
        }
    }
    let two = [good[0].clone(), scattered, good[1].clone()];
    let error = calibrate(&two, SIZE, Some(CameraModel::Pinhole)).unwrap_err();
    assert_eq!(error, CalibrationError::Views { actual: 2, expected: 3 });
    assert_eq!(calibrate(&two, SIZE, None).unwrap().used_views(), 2);
}

#[test]
fn few_views_give_the_focal_length_alone_with_its_deviation() {
    let all = views(&ordinary(), &POSES, 0.25);
    let mut deviations = Vec::new();
    for count in [1, 2] {
        let found = calibrate(&all[..count], SIZE, None).unwrap();
        assert_eq!((found.model, found.parameters.len()), (CameraModel::Focal, 1));
        let (focal, deviation) = value(&found, "f");
        // The principal point is a few pixels off the centre.
        assert!(
            (focal - 908.0).abs() < 2.0 * deviation && deviation < 0.1 * focal,
            "{focal} ± {deviation}"
        );
        deviations.push(deviation);
    }
    assert!(deviations[1] < deviations[0], "{deviations:?}");
    // Views that hardly differ are fitted as well by a wrong focal length: of a tilt of 0.02 by 3,263 pixels.
    for (tilt, is_told) in [(0.02, false), (0.04, false), (0.08, true), (0.1, true), (0.15, true)] {
        let alike = [0.0, 1.0, 2.0].map(|k| {
            (
                [tilt, tilt + 0.01 * k, 0.2 * k],
                [-100.0 + 20.0 * k, -60.0, 400.0 + 30.0 * k],
            )
        });
        let found = calibrate(&views(&ordinary(), &alike, 0.25), SIZE, None);
        assert_eq!(found.is_ok(), is_told, "{tilt} {found:?}");
        if let Ok(found) = found {
            let (focal, deviation) = value(&found, "f");
            assert!((focal - 908.0).abs() < 2.0 * deviation, "{tilt}: {focal} ± {deviation}");
        }
    }
}

#[test]
fn too_few_views_and_parallel_ones_are_refused() {
    let all = views(&ordinary(), &POSES, 0.25);
    let error = calibrate(&all[..2], SIZE, Some(CameraModel::Radial)).unwrap_err();
    assert_eq!(error, CalibrationError::Views { actual: 2, expected: 3 });
    let error = calibrate(&[], SIZE, None).unwrap_err();
    assert!(matches!(error, CalibrationError::Views { actual: 0, .. }), "{error}");
    let parallel = [0.0, 1.0, 2.0, 3.0].map(|k| ([0.0, 0.0, 0.2 * k], [-100.0 + 20.0 * k, -60.0, 400.0 + 30.0 * k]));
    for model in [None, Some(CameraModel::Focal), Some(CameraModel::Pinhole)] {
        let error = calibrate(&views(&ordinary(), &parallel, 0.25), SIZE, model).unwrap_err();
        assert!(matches!(error, CalibrationError::Undetermined(_)), "{model:?} {error}");
        assert!(error.to_string().contains("tilt the target"), "{error}");
    }
}
