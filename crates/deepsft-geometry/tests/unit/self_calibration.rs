use deepsft_geometry::glam::{DQuat, DVec2, DVec3};
use deepsft_geometry::raster::VisibleSurface;
use deepsft_geometry::{
    Camera, Picture, SelfCalibration, SelfCalibrationOptions, Template, draw_template, training_camera,
};

fn template() -> Template {
    let texture = Picture::from_fn(594, 420, |x, y| {
        let cell = ((x / 33) * 7919 + (y / 33) * 104_729) % 251;
        [cell as u8, (251 - cell) as u8, (cell / 2 + 60) as u8]
    });
    Template::thin_shell(texture, 297.0, 210.0).unwrap()
}

/// The sheet bent about the axis `ruling` (rad from y) with `curvature` (1 / mm), then turned about x and y (rad), 480 mm away.
fn sheet(template: &Template, curvature: f64, ruling: f64, [pitch, yaw]: [f64; 2]) -> Vec<DVec3> {
    let turn = DQuat::from_rotation_x(pitch) * DQuat::from_rotation_y(yaw);
    let bent = |p: &DVec3| {
        let p = DQuat::from_rotation_z(-ruling) * *p;
        let angle = curvature * p.x;
        let arc = match curvature {
            0.0 => DVec3::new(p.x, p.y, 0.0),
            _ => DVec3::new(angle.sin() / curvature, p.y, (1.0 - angle.cos()) / curvature),
        };
        turn * (DQuat::from_rotation_z(ruling) * arc) + 480.0 * DVec3::Z
    };
    template.mesh().vertices().iter().map(bent).collect()
}

/// As a tracker sees it that assumes `assumed`: nearer or farther by as much as the focal length is off.
fn as_tracked(vertices: &[DVec3], truth: &Camera, assumed: &Camera) -> Vec<DVec3> {
    let away = 480.0 * (assumed.focal().x / truth.focal().x - 1.0);
    vertices.iter().map(|p| *p + away * DVec3::Z).collect()
}

fn image(template: &Template, vertices: &[DVec3], camera: &Camera) -> Picture {
    draw_template(
        template.texture(),
        &VisibleSurface::new(template.mesh(), vertices, camera).maps(),
    )
}

fn rms(a: &[DVec3], b: &[DVec3]) -> f64 {
    (a.iter().zip(b).map(|(a, b)| a.distance_squared(*b)).sum::<f64>() / a.len() as f64).sqrt()
}

#[test]
fn a_sheet_that_bends_tells_the_focal_length_and_with_it_how_far_it_is() {
    let (template, assumed) = (template(), training_camera());
    let mut calibration = SelfCalibration::new(&template, SelfCalibrationOptions::default()).unwrap();
    for ratio in [0.8, 1.25] {
        let focal = ratio * assumed.focal().x;
        let truth = Camera::pinhole((480, 270), DVec2::splat(focal), DVec2::new(243.0, 131.0)).unwrap();
        // What it took before is forgotten.
        calibration.reset();
        let mut fresh = SelfCalibration::new(&template, SelfCalibrationOptions::default()).unwrap();
        let poses = [[0.5, 0.1], [-0.4, 0.3], [0.1, 0.6], [-0.2, -0.5], [0.45, -0.35]];
        let meshes: Vec<_> = (poses.iter().enumerate())
            .map(|(k, &pose)| sheet(&template, 0.001 * k as f64, 0.2 * k as f64, pose))
            .collect();
        for mesh in &meshes {
            let tracked = as_tracked(mesh, &truth, &assumed);
            let picture = image(&template, mesh, &truth);
            assert!(calibration.offer(&picture, &assumed, &tracked).unwrap());
            assert!(fresh.offer(&picture, &assumed, &tracked).unwrap());
        }
        let found = calibration.solve(20).unwrap().expect("the views tell it");
        assert_eq!(found.camera, fresh.solve(20).unwrap().unwrap().camera);
        let error = (found.camera.focal().x / focal).ln();
        assert!(error.abs() < 0.01, "{ratio}: {error}");
        assert!(
            found.focal_deviation < 0.02 && error.abs() < 3.0 * found.focal_deviation,
            "{found:?}"
        );
        assert_eq!(found.views, meshes.len());
        for (mesh, truth_mesh) in calibration.meshes().zip(&meshes) {
            let (before, after) = (
                rms(&as_tracked(truth_mesh, &truth, &assumed), truth_mesh),
                rms(&mesh, truth_mesh),
            );
            assert!(after < 0.1 * before, "{ratio}: {after} mm, {before} before");
        }
        // The same change for an image of twice the size.
        let source = found.of_source(&assumed.resized((960, 540)).unwrap()).unwrap();
        assert!((source.focal().x / (2.0 * found.camera.focal().x) - 1.0).abs() < 1e-12);
        assert!((source.principal_point() - 2.0 * found.camera.principal_point()).length() < 1e-9);
        // Where a page's camera changes, the views have seldom all had their turn.
        assert!(calibration.step().unwrap().is_none());
    }
}

#[test]
fn a_print_that_is_wider_than_it_was_said_to_be_does_not_lengthen_the_focal_length() {
    let (template, camera) = (template(), training_camera());
    let wider = Template::thin_shell(template.texture().clone(), 300.0, 208.0).unwrap();
    let aspect = (300.0 / 297.0_f64).ln() - (208.0 / 210.0_f64).ln();
    let errors = [0.02, 0.0].map(|aspect_deviation| {
        let options = SelfCalibrationOptions {
            aspect_deviation,
            ..SelfCalibrationOptions::default()
        };
        let mut calibration = SelfCalibration::new(&template, options).unwrap();
        for (k, pose) in [[0.5, 0.1], [-0.4, 0.2], [0.7, -0.1], [-0.6, 0.0], [0.25, -0.2]]
            .into_iter()
            .enumerate()
        {
            let mesh = sheet(&wider, 0.001 * k as f64, 0.2 * k as f64, pose);
            assert!(
                calibration
                    .offer(&image(&wider, &mesh, &camera), &camera, &mesh)
                    .unwrap()
            );
        }
        let found = calibration.solve(20).unwrap().unwrap();
        let off = if aspect_deviation == 0.0 {
            found.aspect
        } else {
            found.aspect - aspect
        };
        assert!(off.abs() < 2e-3, "{found:?}");
        (found.camera.focal().x / camera.focal().x).ln().abs()
    });
    // Held, as the template says it is, it is paid for by the camera.
    assert!(errors[0] < 0.005 && errors[1] > 0.01, "{errors:?}");
}

#[test]
fn frontal_views_of_a_flat_sheet_are_said_to_tell_nothing() {
    let (template, camera) = (template(), training_camera());
    let options = SelfCalibrationOptions {
        min_views: 2,
        ..SelfCalibrationOptions::default()
    };
    let deviation = options.deviations[0];
    let mut calibration = SelfCalibration::new(&template, options).unwrap();
    for across in [-40.0, 40.0] {
        let mesh: Vec<_> = sheet(&template, 0.0, 0.0, [0.0; 2])
            .iter()
            .map(|p| *p + across * DVec3::X)
            .collect();
        assert!(
            calibration
                .offer(&image(&template, &mesh, &camera), &camera, &mesh)
                .unwrap()
        );
    }
    let found = calibration.solve(20).unwrap().unwrap();
    assert!(found.focal_deviation > 0.5 * deviation, "{found:?}");
}

#[test]
fn views_that_say_the_same_are_not_taken_and_another_camera_starts_afresh() {
    let (template, camera) = (template(), training_camera());
    let mut calibration = SelfCalibration::new(&template, SelfCalibrationOptions::default()).unwrap();
    let mesh = sheet(&template, 0.002, 0.0, [0.3, 0.0]);
    let picture = image(&template, &mesh, &camera);
    assert!(calibration.offer(&picture, &camera, &mesh).unwrap());
    assert!(!calibration.offer(&picture, &camera, &mesh).unwrap());
    assert!(calibration.solve(20).unwrap().is_none(), "one view is too few");
    let other = Camera::pinhole((480, 270), DVec2::splat(400.0), DVec2::new(240.0, 135.0)).unwrap();
    assert!(calibration.offer(&picture, &other, &mesh).unwrap());
    assert_eq!(calibration.meshes().count(), 1);
    assert!(calibration.offer(&picture, &other, &mesh[1..]).is_err());
}

#[test]
fn a_view_that_was_not_fitted_yet_does_not_make_room_for_the_next() {
    let (template, camera) = (template(), training_camera());
    let options = SelfCalibrationOptions {
        min_views: 2,
        max_views: 2,
        ..SelfCalibrationOptions::default()
    };
    let mut calibration = SelfCalibration::new(&template, options).unwrap();
    let meshes = [[0.5, 0.1], [-0.4, 0.3], [0.1, 0.6], [-0.2, -0.5]].map(|pose| sheet(&template, 0.001, 0.2, pose));
    for (k, mesh) in meshes.iter().enumerate() {
        let picture = image(&template, mesh, &camera);
        assert!(calibration.offer(&picture, &camera, mesh).unwrap());
        if k == 1 {
            assert!(
                calibration.solve(1).unwrap().is_none(),
                "after one update it is not said"
            );
        }
    }
    let nearest = |mesh: Vec<DVec3>| {
        let distance = |k: &usize| rms(&mesh, &meshes[*k]);
        (0..4).min_by(|a, b| distance(a).total_cmp(&distance(b))).unwrap()
    };
    let mut kept: Vec<usize> = calibration.meshes().map(nearest).collect();
    kept.sort_unstable();
    assert_eq!(kept, [2, 3]);
}

#[test]
fn a_phone_that_changes_its_lens_without_a_word_is_not_told_the_mean_of_both() {
    let (template, assumed) = (template(), training_camera());
    let poses = [
        [0.5, 0.1],
        [-0.4, 0.3],
        [0.1, 0.6],
        [-0.2, -0.5],
        [0.45, -0.35],
        [-0.5, -0.1],
    ];
    // A phone's macro lens, and back; the second time nothing changes.
    for [first, second] in [[1.0, 0.6], [0.7, 1.1], [1.1, 1.1]] {
        let mut calibration = SelfCalibration::new(&template, SelfCalibrationOptions::default()).unwrap();
        let mut told = Vec::new();
        for (ratio, side) in [(first, 1.0), (second, -1.0)] {
            let focal = ratio * assumed.focal().x;
            let truth = Camera::pinhole((480, 270), DVec2::splat(focal), DVec2::new(241.0, 134.0)).unwrap();
            for (k, [pitch, yaw]) in poses.into_iter().enumerate() {
                let mesh = sheet(&template, 0.0008 * k as f64, 0.2 * k as f64, [pitch, side * yaw]);
                let tracked = as_tracked(&mesh, &truth, &assumed);
                let picture = image(&template, &mesh, &truth);
                let is_taken = (0..50).any(|_| {
                    let is_taken = calibration.offer(&picture, &assumed, &tracked).unwrap();
                    is_taken || calibration.step().unwrap().is_some()
                });
                assert!(is_taken, "{ratio}, view {k}");
                // Between two views of a video there are some updates.
                for _ in 0..4 * calibration.meshes().count() {
                    calibration.step().unwrap();
                }
            }
            let found = calibration.solve(20).unwrap().expect("the views tell it");
            println!(
                "{ratio}: {:?}",
                (found.camera.focal().x / focal, found.views, found.focal_deviation)
            );
            told.push((found.camera.focal().x / focal, found.views));
        }
        assert!(
            told.iter().all(|(ratio, _)| ratio.ln().abs() < 0.015),
            "{first}, {second}: {told:?}"
        );
        assert!((first == second) == (told[1].1 > poses.len()), "{told:?}");
    }
}
