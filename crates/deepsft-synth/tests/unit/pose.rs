//! Random poses of a sheet before the camera.

use crate::deform::{DeformationConfig, deform};
use crate::scene::pose::{PoseConfig, fraction_in_view, sample_pose};
use deepsft_geometry::glam::{DAffine3, DQuat, DVec2, DVec3};
use deepsft_geometry::{Picture, Template, training_camera};
use rand::SeedableRng;
use rand_pcg::Pcg64Mcg;

fn sheet(width_mm: f64, height_mm: f64) -> Template {
    Template::thin_shell(Picture::from_fn(1, 1, |_, _| [0; 3]), width_mm, height_mm).unwrap()
}

/// The sheet's centroid, mm, camera frame.
fn centroid_camera(vertices: &[DVec3], pose: &DAffine3) -> DVec3 {
    pose.transform_point3(vertices.iter().sum::<DVec3>() / vertices.len() as f64)
}

/// Depth of the nearest vertex, mm.
fn nearest(vertices: &[DVec3], pose: &DAffine3) -> f64 {
    let depths = vertices.iter().map(|vertex| pose.transform_point3(*vertex).z);
    depths.fold(f64::INFINITY, f64::min)
}

/// Tilt and roll in radians of a rotation tilt * roll: the angle between the z axes, and the
/// rotation about z that is left.
fn tilt_and_roll(pose: &DAffine3) -> (f64, f64) {
    let rotation = DQuat::from_mat3(&pose.matrix3);
    let tilt = (rotation * DVec3::Z).angle_between(DVec3::Z);
    let roll = 2.0 * rotation.z.atan2(rotation.w);
    (
        tilt,
        (roll + std::f64::consts::PI).rem_euclid(std::f64::consts::TAU) - std::f64::consts::PI,
    )
}

#[test]
fn poses_of_bent_sheets_keep_every_bound_and_fill_the_ranges() {
    let (camera, config) = (training_camera(), PoseConfig::default());
    let template = sheet(297.0, 210.0);
    let (mut near, mut far, mut flat, mut steep, mut upside_down, mut whole, mut cut) = (0, 0, 0, 0, 0, 0, 0);
    for seed in 0..1000 {
        let mut rng = Pcg64Mcg::seed_from_u64(seed);
        let vertices = deform(&template, &DeformationConfig::default(), &mut rng);
        let pose = sample_pose(&camera, &vertices, &config, &mut rng);
        let centroid = centroid_camera(&vertices, &pose);
        let distance = centroid.z;
        let (tilt, roll) = tilt_and_roll(&pose);
        let in_view = fraction_in_view(&camera, &vertices, &pose);
        assert!(
            (250.0 - 1e-6..=900.0 + 1e-6).contains(&distance),
            "seed {seed}: {distance} mm"
        );
        assert!(tilt.to_degrees() < 65.0 + 1e-6, "seed {seed}");
        let view_angle = pose.transform_vector3(DVec3::Z).angle_between(centroid);
        assert!(view_angle.to_degrees() < 75.0 + 1e-6, "seed {seed}");
        assert!(in_view >= 0.4, "seed {seed}: {in_view} in view");
        assert!(nearest(&vertices, &pose) >= 60.0, "seed {seed}");
        assert!((pose.matrix3.determinant() - 1.0).abs() < 1e-9);
        near += usize::from(distance < 350.0);
        far += usize::from(distance > 700.0);
        flat += usize::from(tilt.to_degrees() < 20.0);
        steep += usize::from(tilt.to_degrees() > 50.0);
        upside_down += usize::from(roll.to_degrees().abs() > 90.0);
        whole += usize::from(in_view == 1.0);
        cut += usize::from(in_view < 0.8);
    }
    // Shares of the drawn distribution: ln(350 / 250) / ln(3.6) = 26 %, ln(900 / 700) / ln(3.6)
    // = 20 %, sin 20 / sin 65 = 38 %, 1 - sin 50 / sin 65 = 15 %, half; drawing again moves them a little.
    for (count, fraction) in [
        (near, 0.26),
        (far, 0.20),
        (flat, 0.38),
        (steep, 0.15),
        (upside_down, 0.5),
    ] {
        assert!(
            (f64::from(count as u32) / 1000.0 - fraction).abs() < 0.06,
            "{count} of 1000, expected {fraction}"
        );
    }
    assert!(
        whole > 300 && cut > 100,
        "{whole} whole, {cut} cut off by the image's edge"
    );
}

#[test]
fn sheets_are_seen_in_every_part_of_the_image() {
    let (camera, config) = (training_camera(), PoseConfig::default());
    let template = sheet(297.0, 210.0);
    let vertices = template.mesh().vertices();
    let mut counts = [0; 9];
    for seed in 0..500 {
        let pose = sample_pose(&camera, vertices, &config, &mut Pcg64Mcg::seed_from_u64(seed));
        let center = camera.project(pose.translation).unwrap();
        let part = |at: f64, size: f64| ((3.0 * at / size).max(0.0) as usize).min(2);
        counts[3 * part(center.y, 270.0) + part(center.x, 480.0)] += 1;
    }
    assert!(counts.iter().all(|&count| count > 15), "{counts:?}");
}

#[test]
fn a_sheet_too_large_for_the_distances_still_lies_before_the_camera() {
    let camera = training_camera();
    for (width, height) in [(3000.0, 2000.0), (900.0, 900.0)] {
        let template = sheet(width, height);
        for seed in 0..50 {
            let vertices = template.mesh().vertices();
            let pose = sample_pose(
                &camera,
                vertices,
                &PoseConfig::default(),
                &mut Pcg64Mcg::seed_from_u64(seed),
            );
            assert!(
                nearest(vertices, &pose) >= 60.0 - 1e-6,
                "{width} x {height} mm, seed {seed}"
            );
            assert!(fraction_in_view(&camera, vertices, &pose) > 0.0);
        }
    }
}

#[test]
fn without_tilt_and_roll_the_sheet_is_frontal_and_unmirrored() {
    let camera = training_camera();
    let template = sheet(297.0, 210.0);
    let config = PoseConfig {
        max_tilt_deg: 0.0,
        max_roll_deg: 0.0,
        ..PoseConfig::default()
    };
    let pose = sample_pose(
        &camera,
        template.mesh().vertices(),
        &config,
        &mut Pcg64Mcg::seed_from_u64(1),
    );
    let pixel = |u, v| {
        camera
            .project(pose.transform_point3(template.point_template(DVec2::new(u, v)).unwrap()))
            .unwrap()
    };
    let (corner, right, down) = (pixel(0.0, 0.0), pixel(1.0, 0.0), pixel(0.0, 1.0));
    assert!(right.x > corner.x && (right.y - corner.y).abs() < 1e-9);
    assert!(down.y > corner.y && (down.x - corner.x).abs() < 1e-9);
}
