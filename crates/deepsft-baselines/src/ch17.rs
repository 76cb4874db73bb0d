//! CH17: isometric Shape-from-Template in closed form, by surface integration.
//!
//! A. Chhatkuli, D. Pizarro, A. Bartoli, T. Collins, *A Stable Analytical Framework for Isometric Shape-from-Template by Surface
//! Integration*, PAMI 39(5), 2017, on A. Bartoli, Y. Gerard, F. Chadebecq, T. Collins, D. Pizarro, *Shape-from-Template*, PAMI 37(10), 2015.
//!
//! # Equations
//!
//! A point p of the flat template is seen along the ray q = eta(p), and lies at the distance r(p) along its unit ray u(p). Isometry says
//! of the embedding r u that its first fundamental form is the identity:
//!
//! ```text
//! grad r grad r^T + r^2 U = I,   U = J_u^T J_u = (J^T (I - q q^T / e) J) / e,   e = 1 + q^T q,   J = d eta / dp
//! ```
//!
//! The left summand has rank one, so r = 1 / sqrt(l1) and grad r = +- sqrt(1 - l2 / l1) w2, with l1 >= l2 the eigenvalues of U and w2 the
//! eigenvector of l2. The distance is lost where the camera tends to an affine one; the gradient depends on ratios of U alone and stays.
//! So r is the integral of its gradient, and only the constant comes from the local distances.
//!
//! 1. eta is a bicubic B-spline from template to image, by least squares with bending energy.
//! 2. r and grad r at the points of a 50 x 50 grid of the template.
//! 3. The sign of each gradient is that of the gradient of a smooth spline through the local distances.
//! 4. The spline whose gradient is nearest to them is the distance, up to the median of what the local distances are more.
//!
//! # Where we had to decide
//!
//! * DeepSfT calls the method with true registration (GTR) and with that of optical flow (DOF); it says neither how many correspondences it
//!   took nor which weights. Ours: every pixel of the registration, the mean squared error of all, and the weights in [`Ch17`].
//! * The article has two variants, by the gradient of distance and by normals. This is the first.
//! * Grid points without a correspondence nearby say nothing: the splines bend through what is hidden.

use crate::frame::{Correspondence, at_least, rays};
use crate::spline::{Spline, SplineGrid};
use anyhow::Result;
use deepsft_geometry::Maps;
use deepsft_geometry::glam::{DMat2, DVec2, DVec3};

/// Points along each side of the grid on which the equations are solved: that of the authors' code.
const GRID: usize = 50;

/// Fewest correspondences.
const FEWEST: usize = 100;

/// The method with its weights.
#[derive(Clone, Copy, Debug)]
pub struct Ch17 {
    /// Cells of the splines along the template's longer side; the authors' 20 control points are 17 cells.
    pub cells: usize,
    /// Weight of the warp's bending beside the mean squared error of rays (x, y, 1). More loses folds, less follows noise.
    pub warp_bending: f64,
    /// Weight of the distance's bending beside the mean squared error of its gradient.
    pub distance_bending: f64,
}

/// A reconstructed sheet: where each of its points is.
#[derive(Clone, Debug)]
pub struct Ch17Surface {
    warp: Spline<2>,
    distance: Spline<1>,
    constant: f64,
}

/// Solves the equations at one point: the distance in mm, and its gradient up to the sign. `None` where the warp has no area.
fn local_solution(ray: DVec2, jacobian: DMat2) -> Option<(f64, DVec2)> {
    let square = 1.0 + ray.length_squared();
    let along = jacobian.transpose() * ray;
    let outer = DMat2::from_cols(along * along.x, along * along.y);
    let form = (jacobian.transpose() * jacobian - outer * (1.0 / square)) * (1.0 / square);
    let (a, b, c) = (form.x_axis.x, form.x_axis.y, form.y_axis.y);
    let (mean, half) = (f64::midpoint(a, c), ((a - c) / 2.0).hypot(b));
    let (largest, least) = (mean + half, mean - half);
    // Of the two ways to write the eigenvector of the smaller value, the one that does not cancel.
    let vector = if a < c {
        DVec2::new(least - c, b)
    } else {
        DVec2::new(b, least - a)
    };
    let is_surface = largest > 0.0 && least > 0.0;
    let gradient = (1.0 - least / largest).max(0.0).sqrt() * vector.normalize_or_zero();
    is_surface.then(|| (largest.sqrt().recip(), gradient))
}

impl Ch17 {
    /// What is compared.
    pub const COMPARED: Self = Self {
        cells: 17,
        warp_bending: 1e-8,
        distance_bending: 1e-5,
    };

    /// Reconstructs a sheet of `size_mm` from `seen`, which registers points of it.
    /// Fails for fewer than 100 correspondences, and where they leave the splines open.
    pub fn reconstruct(&self, seen: &[Correspondence], size_mm: DVec2) -> Result<Ch17Surface> {
        at_least(seen.len(), FEWEST, "correspondences")?;
        let grid = SplineGrid::new(size_mm, self.cells);
        let warp = Spline::through(grid, rays(seen), 1.0 / seen.len() as f64, self.warp_bending)?;
        let local = |place: DVec2| {
            let jacobian = DMat2::from_cols_array_2d(&warp.derivatives(place));
            let (distance, gradient) = local_solution(warp.value(place).into(), jacobian)?;
            Some((place, distance, gradient))
        };
        let points: Vec<(DVec2, f64, DVec2)> = seen_places(seen, size_mm).into_iter().filter_map(local).collect();
        let weight = 1.0 / points.len().max(1) as f64;
        // Distances in diagonals: their bending is as dear as that of a function without unit.
        let bending = self.distance_bending / size_mm.length_squared();
        let distances = points.iter().map(|&(place, distance, _)| (place, [distance]));
        let smooth = Spline::through(grid, distances, weight / size_mm.length_squared(), bending)?;
        let signed = |&(place, _, gradient): &(DVec2, f64, DVec2)| {
            (place, gradient * gradient.dot(smooth.gradient(place)).signum())
        };
        let distance = Spline::along(grid, points.iter().map(signed), weight, bending)?;
        let more = points.iter().map(|&(place, local, _)| local - distance.value(place)[0]);
        Ok(Ch17Surface {
            constant: median(more.collect()),
            warp,
            distance,
        })
    }
}

impl Ch17Surface {
    /// The point of the sheet at `place` (mm from its upper left corner), mm, camera frame.
    pub fn point(&self, place: DVec2) -> DVec3 {
        let ray = DVec2::from(self.warp.value(place)).extend(1.0);
        ray.normalize() * (self.distance.value(place)[0] + self.constant)
    }

    /// The depth of every pixel that `registration` registers, with that registration. Pixels of a depth that is not positive are left out.
    pub fn maps(&self, registration: &Maps, size_mm: DVec2) -> Maps {
        let mut maps = Maps::empty(registration.size());
        for pixel in (0..registration.depth().len()).filter(|&pixel| registration.inside(pixel)) {
            let depth = self.point(registration.uv(pixel) * size_mm).z;
            if depth > 0.0 && depth.is_finite() {
                maps.set(pixel, depth as f32, registration.registration()[pixel]);
            }
        }
        maps
    }
}

/// The centres of the cells of the grid that hold a correspondence.
fn seen_places(seen: &[Correspondence], size_mm: DVec2) -> Vec<DVec2> {
    let mut is_seen = vec![false; GRID * GRID];
    for point in seen {
        let cell = (point.place / size_mm * GRID as f64).clamp(DVec2::ZERO, DVec2::splat(GRID as f64 - 1.0));
        is_seen[cell.y as usize * GRID + cell.x as usize] = true;
    }
    let centre = |k: usize| (DVec2::new((k % GRID) as f64, (k / GRID) as f64) + 0.5) / GRID as f64 * size_mm;
    (0..GRID * GRID).filter(|&k| is_seen[k]).map(centre).collect()
}

/// The middle value; 0 of none.
pub fn median(mut values: Vec<f64>) -> f64 {
    values.sort_unstable_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frame::tests::{SIZE_MM, correspondences, cylinder};

    /// A sheet that is rolled and turned, seen from a distance.
    fn bent(distance_mm: f64) -> impl Fn(DVec2) -> DVec3 {
        move |place| cylinder(place, 130.0, 0.5) + DVec3::Z * distance_mm
    }

    fn reconstructed(truth: &dyn Fn(DVec2) -> DVec3, side: usize) -> Ch17Surface {
        let seen = correspondences(truth, side);
        Ch17::COMPARED.reconstruct(&seen, SIZE_MM).unwrap()
    }

    #[test]
    fn a_developable_surface_with_exact_registration_is_exact_in_the_limit_of_fine_splines() {
        let errors = [6, 12, 24].map(|cells| {
            let method = Ch17 {
                cells,
                warp_bending: 1e-14,
                distance_bending: 1e-9,
            };
            let truth = bent(500.0);
            let places = (0..400).map(|k| DVec2::new((k % 20) as f64 + 0.5, (k / 20) as f64 + 0.5) / 20.0 * SIZE_MM);
            let surface = method.reconstruct(&correspondences(&truth, 120), SIZE_MM).unwrap();
            let errors = places.map(|place| surface.point(place).distance(truth(place)));
            errors.sum::<f64>() / 400.0
        });
        assert!(errors[1] < errors[0] / 2.0 && errors[2] < errors[1] / 2.0, "{errors:?}");
        assert!(errors[2] < 0.05, "{errors:?}");
    }

    #[test]
    fn a_frontal_plane_has_the_distance_that_its_size_in_the_image_says() {
        // No gradient has a direction there but that of the ray, and eigenvalues are nearly equal.
        let truth = |place: DVec2| (place - SIZE_MM / 2.0).extend(600.0);
        let surface = reconstructed(&truth, 60);
        for place in [DVec2::new(30.0, 40.0), SIZE_MM / 2.0, DVec2::new(250.0, 190.0)] {
            let point = surface.point(place);
            assert!(point.distance(truth(place)) < 0.5, "{place}: {point}");
        }
    }

    #[test]
    fn the_shape_stays_where_perspective_is_weak_and_only_the_distance_is_lost() {
        // From 20 m: a local distance is as good as the ratio of the warp's derivatives, the gradient is not hurt.
        let truth = bent(20_000.0);
        let surface = reconstructed(&truth, 120);
        let relief = |at: &dyn Fn(DVec2) -> DVec3| at(SIZE_MM / 2.0).z - at(SIZE_MM * DVec2::new(0.1, 0.5)).z;
        let (got, expected) = (relief(&|place| surface.point(place)), relief(&truth));
        let error = (got - expected).abs();
        assert!(error < 0.05 * expected.abs(), "{got} mm, expected {expected} mm");
    }
}
