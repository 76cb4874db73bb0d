//! The print against the image.

use super::local_contrast::LocalContrast;
use crate::Camera;
use crate::solver::surface_point::AnchoredPoint;
use crate::solver::{Energy, ResidualSink, Robust};
use glam::DVec3;

/// Photometric energy: weight times the sum over points of the template's surface of
/// rho(I(pi(p)) - T(p)), I the image and T the print, both locally normalised (no unit; a contrast of one
/// is one local deviation). A point that leaves the image counts as far off, without a gradient.
pub(crate) struct Photometric<'a> {
    pub camera: &'a Camera,
    pub image: &'a LocalContrast,
    /// Points and what the print shows there.
    pub points: &'a [(AnchoredPoint, f64)],
    pub weight: f64,
    pub robust: Robust,
}

/// Residual of a point outside the image.
const OUTSIDE: f64 = 2.0;

impl Energy for Photometric<'_> {
    fn name(&self) -> &'static str {
        "photometric"
    }

    fn stencils(&self, visit: &mut dyn FnMut(&[usize])) {
        self.points.iter().for_each(|(p, _)| visit(&p.corners));
    }

    fn energy(&self, vertices: &[DVec3]) -> f64 {
        let cost = |(point, print): &(AnchoredPoint, f64)| {
            let Some(pixel) = self.camera.project(point.position(vertices)) else {
                return f64::INFINITY;
            };
            let residual = self.image.sample(pixel).map_or(OUTSIDE, |(value, _)| value - print);
            self.robust.rho(residual * residual)
        };
        self.weight * self.points.iter().map(cost).sum::<f64>()
    }

    fn linearize(&self, vertices: &[DVec3], sink: &mut dyn ResidualSink) {
        for (point, print) in self.points {
            let Some((pixel, [x, y])) = self.camera.project_with_gradients(point.position(vertices)) else {
                continue;
            };
            if let Some((value, gradient)) = self.image.sample(pixel) {
                let residual = value - print;
                let weight = self.weight * self.robust.weight(residual * residual);
                sink.scalar(residual, weight, &point.spread(gradient.x * x + gradient.y * y));
            }
        }
    }
}
