//! The perspective map between a plane and its image, and what it says of camera and pose.

use crate::correspondence::Correspondence;
use deepsft_geometry::glam::{DMat3, DVec2, DVec3};
use deepsft_geometry::{Camera, RigidMotion, least_squares};

/// The perspective map that brings the first of each pair near the second: homogeneous coordinates, least squares of
/// the linear equations, origins and scales equalised. `None` for points on a line.
pub fn homography(pairs: &[(DVec2, DVec2)]) -> Option<DMat3> {
    let [(from, from_scale), (to, to_scale)] = [
        equalised(pairs.iter().map(|p| p.0)),
        equalised(pairs.iter().map(|p| p.1)),
    ];
    // The last entry is 1: the centre of the points is no vanishing point.
    let equations = pairs.iter().flat_map(|&(a, b)| {
        let (p, q) = ((a - from) * from_scale, (b - to) * to_scale);
        [
            ([p.x, p.y, 1.0, 0.0, 0.0, 0.0, -q.x * p.x, -q.x * p.y], q.x),
            ([0.0, 0.0, 0.0, p.x, p.y, 1.0, -q.y * p.x, -q.y * p.y], q.y),
        ]
    });
    let [a, b, c, d, e, f, g, h] = least_squares(equations)?;
    let between = DMat3::from_cols_array(&[a, d, g, b, e, h, c, f, 1.0]);
    let before = DMat3::from_scale(DVec2::splat(from_scale)) * DMat3::from_translation(-from);
    let after = DMat3::from_translation(to) * DMat3::from_scale(DVec2::splat(1.0 / to_scale));
    let whole = after * between * before;
    whole.is_finite().then_some(whole)
}

/// The mean of points, and the scale that makes their mean square distance from it 2.
fn equalised(points: impl Iterator<Item = DVec2> + Clone) -> (DVec2, f64) {
    let count = points.clone().count().max(1) as f64;
    let mean = points.clone().sum::<DVec2>() / count;
    let square = points.map(|p| p.distance_squared(mean)).sum::<f64>() / count;
    (mean, (2.0 / square.max(1e-300)).sqrt())
}

/// The focal length, in the unit of the images, of a camera with square pixels and its principal point at the images' origin,
/// which sees planes by `homographies`: the two sides of a square are at right angles and equally long (Zhang 2000). `None` where
/// no focal length fits.
pub fn focal_length(homographies: &[DMat3]) -> Option<f64> {
    let (mut ab, mut aa) = (0.0, 0.0);
    for h in homographies {
        let unit = (h.x_axis.length_squared() + h.y_axis.length_squared()).sqrt();
        let (u, v) = (h.x_axis / unit, h.y_axis / unit);
        let (u_image, v_image) = (u.truncate(), v.truncate());
        let at_right_angles = (u_image.dot(v_image), u.z * v.z);
        let (u2, v2) = (u_image.length_squared(), v_image.length_squared());
        for (a, b) in [at_right_angles, (u2 - v2, u.z * u.z - v.z * v.z)] {
            ab += a * b;
            aa += a * a;
        }
    }
    // a / f^2 + b = 0.
    let inverse_square = -ab / aa;
    (inverse_square.is_finite() && inverse_square > 0.0).then(|| inverse_square.sqrt().recip())
}

/// The pose of a plane that `camera` sees: the motion from the target's frame (z = 0) to the camera's. `None` for points on a line
/// or a plane behind the camera.
pub fn pose(camera: &Camera, points: &[Correspondence]) -> Option<RigidMotion> {
    let ray = |point: &Correspondence| (point.place_mm, camera.ray_from_pixel(point.pixel));
    let h = homography(&points.iter().map(ray).collect::<Vec<_>>())?;
    let scale = 2.0 / (h.x_axis.length() + h.y_axis.length());
    let scale = if h.z_axis.z < 0.0 { -scale } else { scale };
    let (x, y) = (h.x_axis * scale, h.y_axis * scale);
    // The rotation nearest to these axes. Each counts both ways, so that their mean is the origin.
    let axes = [(DVec3::X, x), (DVec3::Y, y), (DVec3::Z, x.cross(y))];
    let axes = axes.into_iter();
    let both = axes.flat_map(|(from, to)| [(from, to, 1.0), (-from, -to, 1.0)]);
    let pose = RigidMotion {
        translation: h.z_axis * scale,
        ..RigidMotion::align(both, RigidMotion::IDENTITY)
    };
    let is_seen = |point: &Correspondence| camera.project(pose.apply(point.place_mm.extend(0.0))).is_some();
    points.iter().all(is_seen).then_some(pose)
}
