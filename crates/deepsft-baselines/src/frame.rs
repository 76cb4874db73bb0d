//! What a method is given of a frame.

use anyhow::{Result, ensure};
use deepsft_geometry::glam::DVec2;
use deepsft_geometry::solver::{ImagePoint, SurfacePoint};
use deepsft_geometry::{Camera, Maps};

/// A point of the template and where the camera sees it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Correspondence {
    /// Place on the sheet, mm from its upper left corner.
    pub place: DVec2,
    /// Place in the image, pixels.
    pub pixel: DVec2,
    /// The ray (x, y, 1) through it.
    pub ray: DVec2,
}

impl Correspondence {
    /// The texture coordinates of its place on a sheet of `size_mm`.
    pub fn uv(&self, size_mm: DVec2) -> DVec2 {
        (self.place / size_mm).clamp(DVec2::ZERO, DVec2::ONE)
    }

    /// What a fit is told of it, with its `point` on the mesh.
    pub fn image_point(&self, point: SurfacePoint) -> ImagePoint {
        ImagePoint {
            point,
            pixel: self.pixel,
            weight: 1.0,
        }
    }
}

/// A correspondence for each pixel of a registration, on a sheet of `size_mm`.
pub fn correspondences(registration: &Maps, camera: &Camera, size_mm: DVec2) -> Vec<Correspondence> {
    let width = registration.size().width;
    let of_pixel = |index: usize| {
        let pixel = DVec2::new((index % width) as f64 + 0.5, (index / width) as f64 + 0.5);
        Correspondence {
            place: registration.uv(index) * size_mm,
            pixel,
            ray: camera.ray_from_pixel(pixel),
        }
    };
    let inside = (0..registration.depth().len()).filter(|&index| registration.inside(index));
    inside.map(of_pixel).collect()
}

/// The rays of `points` by their places.
pub fn rays(points: &[Correspondence]) -> impl Iterator<Item = (DVec2, [f64; 2])> {
    points.iter().map(|point| (point.place, point.ray.to_array()))
}

/// Checks that a method has enough to work with.
/// Fails where `count` of `what` are fewer than the `least` number.
pub fn at_least(count: usize, least: usize, what: &str) -> Result<()> {
    ensure!(count >= least, "{count} {what}, expected at least {least}");
    Ok(())
}

/// Sheets of known shape, for tests.
#[cfg(test)]
pub mod tests {
    use super::*;
    use deepsft_geometry::glam::{DQuat, DVec3};
    use deepsft_geometry::{Picture, Template, training_camera};

    /// The size of an A4 sheet.
    pub const SIZE_MM: DVec2 = DVec2::new(297.0, 210.0);

    /// A blank sheet of that size.
    pub fn template() -> Template {
        Template::thin_shell(Picture::from_fn(1, 1, |_, _| [0; 3]), SIZE_MM.x, SIZE_MM.y).unwrap()
    }

    /// The vertices of its mesh on a surface.
    pub fn vertices_on(surface: impl Fn(DVec2) -> DVec3) -> Vec<DVec3> {
        let places = template().mesh().texture_coordinates().to_vec().into_iter();
        places.map(|uv| surface(uv * SIZE_MM)).collect()
    }

    /// The mean distance of its vertices from a surface, mm.
    pub fn mean_error(vertices: &[DVec3], surface: impl Fn(DVec2) -> DVec3) -> f64 {
        let pairs = vertices.iter().zip(vertices_on(surface));
        pairs.map(|(p, truth)| p.distance(truth)).sum::<f64>() / vertices.len() as f64
    }

    /// The point at `place` of a sheet that is rolled around an axis parallel to y, and turned by `turn` about both.
    pub fn cylinder(place: DVec2, radius: f64, turn: f64) -> DVec3 {
        let p = place - SIZE_MM / 2.0;
        let (sin, cos) = (p.x / radius).sin_cos();
        let rolled = DVec3::new(radius * sin, p.y, radius * (1.0 - cos));
        DQuat::from_rotation_x(0.6 * turn) * (DQuat::from_rotation_y(turn) * rolled)
    }

    /// Exact correspondences of a surface at `side` x `side` places.
    pub fn correspondences(surface: &dyn Fn(DVec2) -> DVec3, side: usize) -> Vec<Correspondence> {
        let camera = training_camera();
        let of = |k: usize| {
            let place = DVec2::new((k % side) as f64, (k / side) as f64) / (side - 1) as f64 * SIZE_MM;
            let p = surface(place);
            let ray = p.truncate() / p.z;
            Correspondence {
                place,
                pixel: camera.pixel_from_ray(ray).unwrap(),
                ray,
            }
        };
        (0..side * side).map(of).collect()
    }
}
