//! What is unknown of a camera, as numbers that can be solved for.

use crate::camera::{Camera, Lens};
use crate::error::GeometryError;
use glam::{DVec2, DVec3, DVec4};

/// The derivative of where `camera` shows a point (camera frame) with respect to its parameters (ln f, cx / f, cy / f, k1), pixels.
pub(super) fn pixel_gradients(camera: &Camera, p_camera: DVec3) -> [DVec2; 4] {
    let focal = camera.focal();
    let ray = p_camera.truncate() / p_camera.z;
    let from_centre = camera.pixel_from_ray(ray).unwrap_or_default() - camera.principal_point();
    [
        from_centre,
        DVec2::new(focal.x, 0.0),
        DVec2::new(0.0, focal.y),
        focal * ray * ray.length_squared(),
    ]
}

/// What changes from `from` to `camera`, in the same parameters.
pub(super) fn between(from: &Camera, camera: &Camera) -> DVec4 {
    let shift = (camera.principal_point() - from.principal_point()) / from.focal();
    DVec4::new(
        (camera.focal().x / from.focal().x).ln(),
        shift.x,
        shift.y,
        distortion(camera)[0] - distortion(from)[0],
    )
}

/// The camera after a `step` in these parameters. A fisheye lens stays as it is.
pub(super) fn stepped(camera: &Camera, step: DVec4) -> Result<Camera, GeometryError> {
    let focal = camera.focal() * step.x.exp();
    let centre = camera.principal_point() + camera.focal() * DVec2::new(step.y, step.z);
    let pinhole = Camera::pinhole(camera.size(), focal, centre)?;
    if let Lens::Fisheye(coefficients) = camera.lens() {
        return pinhole.with_fisheye(coefficients);
    }
    let [k1, k2, p1, p2, k3] = distortion(camera);
    pinhole.with_distortion([k1 + step.w, k2, p1, p2, k3])
}

/// The polynomial's coefficients; zeros for other lenses.
fn distortion(camera: &Camera) -> [f64; 5] {
    match camera.lens() {
        Lens::Polynomial(coefficients) => coefficients,
        Lens::Pinhole | Lens::Fisheye(_) => [0.0; 5],
    }
}
