//! All of OpenCV's distortion coefficients, as five of them.

use super::lens::{Lens, check, check_finite, refused};
use super::pinhole::Camera;
use crate::error::GeometryError;
use faer::prelude::Solve;
use faer::{Mat, Side};
use glam::DVec2;

/// The coefficients in OpenCV's order.
const NAMES: [&str; 14] = [
    "k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6", "s1", "s2", "s3", "s4", "tx", "ty",
];

/// Rays across the image by which a lens is approximated, and how far beyond the image they begin.
const RAYS: usize = 48;
const BEYOND: f64 = 1.5;

/// Largest distance from the lens that is approximated, pixels.
const NEAR_PX: f64 = 0.5;

impl Camera {
    /// The same camera with 0, 4, 5, 8, 12 or 14 of OpenCV's distortion coefficients (k1, k2, p1, p2, k3, k4, k5, k6, s1 to s4, tx, ty).
    ///
    /// More than five, of the rational, thin prism and tilted models, are approximated by the five that are nearest in the image, by least
    /// squares.
    ///
    /// # Errors
    /// [`GeometryError::CameraParameter`] for another number of them, one that is not finite, a tilted sensor, or a lens that five
    /// coefficients do not follow to half a pixel.
    pub fn with_opencv_distortion(self, coefficients: &[f64]) -> Result<Self, GeometryError> {
        let (count, mut all) = (coefficients.len(), [0.0; 14]);
        let is_known = [0, 4, 5, 8, 12, 14].contains(&count);
        let expected = "0, 4, 5, 8, 12 or 14 coefficients, as OpenCV has them";
        check("number of distortion coefficients", count as f64, is_known, expected)?;
        all[..count].copy_from_slice(coefficients);
        check_finite(NAMES, all)?;
        let [first @ .., tx, ty] = all;
        let tilt = tx.abs().max(ty.abs());
        check(
            "tilt of the sensor",
            tilt,
            tilt == 0.0,
            "0: a tilted sensor is not read",
        )?;
        let [k1, k2, p1, p2, k3, more @ ..] = first;
        if more == [0.0; 7] {
            return self.with_distortion([k1, k2, p1, p2, k3]);
        }
        let rays = self.rays_in_image(&first);
        let nearest = least_squares(rays.iter().flat_map(|&(ray, place)| rows(ray, place - ray)));
        let expected = "coefficients whose lens shows rays in the image";
        let nearest = nearest.ok_or_else(|| refused("distortion", rays.len() as f64, expected))?;
        let lens = Lens::Polynomial(nearest);
        let distance = |&(ray, place): &(DVec2, DVec2)| ((lens.distort(ray) - place) * self.focal()).length();
        let farthest = rays.iter().map(distance).fold(0.0, f64::max);
        let expected =
            "a rational lens that k1, k2, p1, p2, k3 follow to half a pixel: calibrate with these five alone";
        let name = "distance of the lens from its approximation, pixels";
        check(name, farthest, farthest <= NEAR_PX, expected)?;
        self.with_distortion(nearest)
    }

    /// Rays (x, y, 1) that a lens shows in the image, and where: as far out as they land farther out the longer they are.
    fn rays_in_image(&self, lens: &[f64; 12]) -> Vec<(DVec2, DVec2)> {
        let (size, focal) = (self.size().as_dvec2(), self.focal());
        let corner = BEYOND * size.max(self.principal_point()) / focal;
        let place = |ray| rational(lens, ray);
        let longest = corner.length();
        let steps = (1..=8 * RAYS).map(|k| longest * k as f64 / (8 * RAYS) as f64);
        let radius = |length: f64| place(DVec2::X * length).length();
        let reach = steps.clone().zip(steps.skip(1)).find(|(a, b)| radius(*b) <= radius(*a));
        let reach = reach.map_or(longest, |(a, _)| a);
        let along = |k: usize| 2.0 * k as f64 / RAYS as f64 - 1.0;
        let grid = (0..=RAYS).flat_map(|i| (0..=RAYS).map(move |j| corner * DVec2::new(along(i), along(j))));
        let inside = |place: DVec2| {
            let pixel = place * focal + self.principal_point();
            pixel.cmpge(DVec2::ZERO).all() && pixel.cmple(size).all()
        };
        grid.filter(|ray| ray.length() <= reach)
            .map(|ray| (ray, place(ray)))
            .filter(|(_, place)| inside(*place))
            .collect()
    }
}

/// Where OpenCV's rational model with thin prisms takes a ray (x, y, 1).
fn rational(&[k1, k2, p1, p2, k3, k4, k5, k6, s1, s2, s3, s4]: &[f64; 12], ray: DVec2) -> DVec2 {
    let r2 = ray.length_squared();
    let polynomial = |[a, b, c]: [f64; 3]| 1.0 + r2 * (a + r2 * (b + r2 * c));
    let tangential = Lens::Polynomial([0.0, 0.0, p1, p2, 0.0]).distort(ray) - ray;
    let prism = r2 * DVec2::new(s1 + s2 * r2, s3 + s4 * r2);
    ray * polynomial([k1, k2, k3]) / polynomial([k4, k5, k6]) + tangential + prism
}

/// The two equations that ask k1, k2, p1, p2, k3 to move a ray by `shift`, with their right-hand sides.
fn rows(DVec2 { x, y }: DVec2, shift: DVec2) -> [([f64; 5], f64); 2] {
    let r2 = x * x + y * y;
    let (xy, r4, r6) = (2.0 * x * y, r2 * r2, r2 * r2 * r2);
    [
        ([x * r2, x * r4, xy, r2 + 2.0 * x * x, x * r6], shift.x),
        ([y * r2, y * r4, r2 + 2.0 * y * y, xy, y * r6], shift.y),
    ]
}

/// Finds the unknowns that fulfil linear equations, each with its right-hand side, best, by the normal equations. `None` where they do not
/// tell them.
pub fn least_squares<const N: usize>(equations: impl Iterator<Item = ([f64; N], f64)>) -> Option<[f64; N]> {
    let (mut normal, mut right) = (Mat::<f64>::zeros(N, N), Mat::<f64>::zeros(N, 1));
    for (row, side) in equations {
        for i in 0..N {
            (0..N).for_each(|j| normal[(i, j)] += row[i] * row[j]);
            right[(i, 0)] += row[i] * side;
        }
    }
    let solved = normal.llt(Side::Lower).ok()?.solve(&right);
    Some(std::array::from_fn(|i| solved[(i, 0)]))
}
