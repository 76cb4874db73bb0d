//! Rigid alignment of points.

use deepsft_geometry::RigidMotion;
use deepsft_geometry::glam::{DQuat, DVec3};

const MOTION: RigidMotion = RigidMotion {
    rotation: DQuat::from_xyzw(0.5, -0.5, 0.5, 0.5),
    translation: DVec3::new(10.0, -20.0, 500.0),
};

#[test]
fn four_corners_of_a_sheet_give_its_motion_back_and_a_weight_of_zero_counts_for_nothing() {
    let corners = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)];
    let pairs = corners.map(|(x, y)| DVec3::new(100.0 * x, 70.0 * y, 0.0));
    let pairs = pairs.map(|p| (p, MOTION.apply(p), 2.0));
    let stray = (DVec3::ONE, DVec3::splat(1e4), 0.0);
    let found = RigidMotion::align(pairs.into_iter().chain([stray]), RigidMotion::IDENTITY);
    for (p, q, _) in pairs {
        assert!((found.apply(p) - q).length() < 1e-9);
    }
}

#[test]
fn one_point_is_carried_over_by_the_guessed_rotation_and_none_by_the_guess() {
    let p = DVec3::new(3.0, 4.0, 5.0);
    let one = [(p, DVec3::new(0.0, 0.0, 700.0), 1.0)];
    let found = RigidMotion::align(one.into_iter(), RigidMotion::IDENTITY);
    assert_eq!(found.rotation, DQuat::IDENTITY);
    assert!((found.apply(p) - one[0].1).length() < 1e-12);
    assert_eq!(RigidMotion::align([].into_iter(), MOTION), MOTION);
}
