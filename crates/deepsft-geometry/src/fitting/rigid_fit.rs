//! Rigid motions: what brings a drawn mesh onto the image, and the second pose of a solid of which one side is seen.

use crate::camera::Camera;
use crate::image::ContrastNormalizedImage;
use crate::mesh::{RigidMotion, TriangleMesh};
use crate::solver::Robust;
use glam::{DMat3, DQuat, DVec3};
use std::cmp::Ordering;

/// Damping as a fraction of the diagonal: keeps the motion that the points do not show at zero.
const DAMPING: f64 = 1e-3;

/// Longest turn of a step, radians, and longest shift, as a fraction of the distance: beyond, the linearisation is void.
const LONGEST_STEP: f64 = 0.2;

/// Moves points (camera frame, mm) with what is printed there by up to `steps` robust Gauss-Newton steps of a rigid motion
/// until the image shows it there. The rotation and translation of p -> rotation (p - centre) + centre + translation.
pub(crate) fn rigid_fit(
    image: &ContrastNormalizedImage,
    camera: &Camera,
    points: &[(DVec3, f64)],
    robust: Robust,
    steps: usize,
) -> impl Fn(DVec3) -> DVec3 + use<> {
    let centre = points.iter().map(|p| p.0).sum::<DVec3>() / points.len().max(1) as f64;
    let (mut rotation, mut translation) = (DQuat::IDENTITY, DVec3::ZERO);
    let place = |rotation: DMat3, translation: DVec3, p: DVec3| rotation * (p - centre) + centre + translation;
    // Rotation in radians against translation in mm: a unit of length makes them alike.
    let length =
        (points.iter().map(|p| (p.0 - centre).length_squared()).sum::<f64>() / points.len().max(1) as f64).sqrt();
    let cost = |rotation: DQuat, translation: DVec3| -> f64 {
        let rotation = DMat3::from_quat(rotation);
        let square = |&(p, printed): &(DVec3, f64)| {
            // As in the mesh solver: a step behind the camera is no step.
            let Some(pixel) = camera.project(place(rotation, translation, p)) else {
                return f64::INFINITY;
            };
            let residual = image.sample_continued(pixel).map_or(1.0, |(seen, _)| seen - printed);
            residual * residual
        };
        robust.sum(points.iter().map(square))
    };
    let outer = |a: DVec3, b: DVec3| DMat3::from_cols(a * b.x, a * b.y, a * b.z);
    let damped = |m: DMat3| m + DMat3::from_diagonal(DAMPING * DVec3::new(m.x_axis.x, m.y_axis.y, m.z_axis.z));
    let mut here = cost(rotation, translation);
    for _ in 0..steps {
        // Normal equations of the shift and the turn. Not solved by faer: its order of sums goes by the processor's vectors, and tracking
        // then differs between browser and native program by half a millimetre instead of a third.
        let (mut shifts, mut mixed, mut turns) = (DMat3::ZERO, DMat3::ZERO, DMat3::ZERO);
        let (mut pull, mut torque) = (DVec3::ZERO, DVec3::ZERO);
        let turned = DMat3::from_quat(rotation);
        for &(p, printed) in points {
            let position = place(turned, translation, p);
            let Some((pixel, [dx, dy])) = camera.project_with_gradients(position) else {
                continue;
            };
            let Some((seen, slope)) = image.sample_continued(pixel) else {
                continue;
            };
            let residual = seen - printed;
            let weight = robust.weight(residual * residual);
            let gradient = slope.x * dx + slope.y * dy;
            let turn = (position - centre - translation).cross(gradient) / length;
            shifts += outer(weight * gradient, gradient);
            mixed += outer(weight * turn, gradient);
            turns += outer(weight * turn, turn);
            pull -= weight * residual * gradient;
            torque -= weight * residual * turn;
        }
        // The shift is eliminated (the Schur complement).
        let shift_of = damped(shifts).inverse();
        let turning = damped(turns) - mixed * shift_of * mixed.transpose();
        let turn = turning.inverse() * (torque - mixed * (shift_of * pull));
        let shift = shift_of * (pull - mixed.transpose() * turn);
        if !(turn.is_finite() && shift.is_finite()) {
            break;
        }
        let turn = turn / length;
        let excess = (turn.length() / LONGEST_STEP)
            .max(shift.length() / (LONGEST_STEP * centre.z))
            .max(1.0);
        let turned = (DQuat::from_scaled_axis(turn / excess) * rotation).normalize();
        let shifted = translation + shift / excess;
        let there = cost(turned, shifted);
        // A cost that is not a number is no improvement either.
        if there.partial_cmp(&here) != Some(Ordering::Less) {
            break;
        }
        (rotation, translation) = (turned, shifted);
        let settled = here - there < 1e-3 * here;
        here = there;
        if settled {
            break;
        }
    }
    move |p| DMat3::from_quat(rotation) * (p - centre) + centre + translation
}

/// A side is what faces one way: the power of the cosine that a face counts with, and the steps that look for the way.
const SIDE: i32 = 8;
const SIDE_STEPS: usize = 8;

/// Steps of orthogonal iteration, few: in the end it comes back to where the mesh was.
const POSE_STEPS: usize = 20;

/// Where the solid `mesh` looks almost as it does at `vertices` (camera frame, mm): the side that the image confirms most is tilted the other
/// way, as weak perspective allows it (Schweighofer and Pinz 2006). `None` where the image confirms nothing.
pub(super) fn reversed_pose(mesh: &TriangleMesh, vertices: &[DVec3], confidence: &[f32]) -> Option<Vec<DVec3>> {
    let rest = mesh.vertices();
    // The faces that are seen, each with twice its area times how far it is confirmed, along its normal.
    let seen = mesh.faces().iter().filter_map(|&face| {
        let [a, b, c] = face.map(|v| rest[v]);
        let confirmed = face.iter().map(|&v| f64::from(confidence[v])).sum::<f64>() / 3.0;
        (confirmed > 0.0).then(|| (face, confirmed * (b - a).cross(c - a)))
    });
    let seen: Vec<_> = seen.collect();
    let share = |n: DVec3, way: DVec3| n.normalize_or_zero().dot(way).max(0.0).powi(SIDE);
    let mut way = seen.iter().map(|(_, n)| *n).sum::<DVec3>().normalize_or_zero();
    for _ in 0..SIDE_STEPS {
        let facing = seen.iter().map(|(_, n)| share(*n, way) * *n);
        way = facing.sum::<DVec3>().normalize_or_zero();
    }
    let mut weights = vec![0.0; rest.len()];
    for (face, n) in &seen {
        face.iter().for_each(|&v| weights[v] += share(*n, way) * n.length());
    }
    let told = rest.iter().zip(vertices).zip(weights);
    let side: Vec<_> = told
        .filter(|(_, weight)| *weight > 0.0)
        .map(|((p, q), weight)| (*p, *q, weight))
        .collect();
    let total: f64 = side.iter().map(|(.., weight)| weight).sum();
    let depth = side.iter().map(|(_, q, weight)| weight * q.z).sum::<f64>() / total;
    let reversed = side
        .iter()
        .map(|&(p, q, weight)| (p, q * (depth / q.z).powi(2), weight));
    let mut pose = RigidMotion::align(reversed, RigidMotion::IDENTITY);
    for _ in 0..POSE_STEPS {
        pose = pose.towards_rays(side.iter().copied());
    }
    (total > 0.0).then(|| rest.iter().map(|&p| pose.apply(p)).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::training_camera;
    use crate::image::Picture;
    use glam::DVec2;

    #[test]
    fn a_small_rigid_motion_of_a_bent_surface_is_found() {
        let camera = training_camera();
        let wave = |x: f64, y: f64| {
            120.0 + 60.0 * ((0.21 * x).sin() * (0.17 * y + 0.4).cos() + 0.4 * (0.1 * x - 0.13 * y).sin())
        };
        let picture = Picture::from_fn(480, 270, |x, y| [wave(x as f64, y as f64) as u8; 3]);
        let image = ContrastNormalizedImage::new(&picture, 2.0, 10.0);
        // What is printed is what the image shows; then the points are put elsewhere.
        let turn = DQuat::from_rotation_z(0.02) * DQuat::from_rotation_y(-0.03);
        let shift = DVec3::new(4.0, -3.0, 8.0);
        let centre = DVec3::new(0.0, 0.0, 480.0);
        let mut points = Vec::new();
        for y in (40..230).step_by(6) {
            for x in (100..380).step_by(6) {
                let pixel = DVec2::new(x as f64 + 0.5, y as f64 + 0.5);
                let p = camera.unproject(pixel, 450.0 + 0.002 * (pixel.x - 240.0).powi(2));
                let printed = image.sample(pixel).unwrap().0;
                points.push((p, turn * (p - centre) + centre + shift, printed));
            }
        }
        let moved: Vec<_> = points.iter().map(|&(_, there, printed)| (there, printed)).collect();
        let back = rigid_fit(&image, &camera, &moved, Robust::Cauchy(0.8), 20);
        let farthest = |placed: &dyn Fn(DVec3) -> DVec3| {
            let ways = points.iter().map(|&(p, there, _)| placed(there).distance(p));
            ways.fold(0.0, f64::max)
        };
        let (worst, start) = (farthest(&back), farthest(&|there| there));
        assert!(start > 8.0 && worst < 1.0, "{worst} of {start} mm are left");
    }

    #[test]
    fn nothing_printed_moves_nothing() {
        let image = ContrastNormalizedImage::new(&Picture::from_fn(480, 270, |_, _| [90; 3]), 2.0, 10.0);
        let points = [(DVec3::new(0.0, 0.0, 500.0), 0.0), (DVec3::new(30.0, 0.0, 500.0), 0.0)];
        for points in [&points[..], &[]] {
            let placed = rigid_fit(&image, &training_camera(), points, Robust::Cauchy(0.8), 5);
            assert_eq!(placed(DVec3::Z), DVec3::Z);
        }
    }
}
