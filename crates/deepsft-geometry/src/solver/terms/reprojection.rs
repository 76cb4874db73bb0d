//! Registered points of the template at image positions.

use crate::camera::Camera;
use crate::error::Result;
use crate::mesh::{AnchoredPoint, SurfacePoint, TriangleMesh};
use crate::solver::energy::{Energy, ResidualSink, Robust, check_robust, check_weight};
use glam::{DVec2, DVec3};

/// Pixels beyond which an error costs no more. So much costs a point that the camera does not project, behind it or where its
/// lens folds back: a finder that is wrong can put it there, and the other points then say what the shape is.
const LARGEST_ERROR_PX: f64 = 1e4;

/// A template point registered to an image position.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ImagePoint {
    /// The point on the template.
    pub point: SurfacePoint,
    /// Where the image shows it, pixels. A position that is not finite counts as not seen.
    pub pixel: DVec2,
    /// Its weight. With residuals in pixels, 1 / sigma^2 for a registration with error sigma.
    pub weight: f64,
}

/// Reprojection error: the sum over registered points of w rho(|pi(p) - x|^2), pixels, with the camera's
/// distortion; a point behind the camera counts as 10,000 pixels off. The registration constraint of analytic Shape-from-Template (Bartoli et al. 2015) as a
/// robust cost; the paper leaves it to the network.
#[derive(Clone, Debug)]
pub struct Reprojection {
    camera: Camera,
    points: Vec<(AnchoredPoint, DVec2, f64)>,
    robust: Robust,
}

impl Reprojection {
    /// Takes the registered points of one frame. `robust` has its scale in pixels (Cauchy with 2 to 4 px suits a
    /// network's registration). Points that are not finite or lie on no face, or on one that names a vertex
    /// twice, are left out.
    ///
    /// # Errors
    /// [`GeometryError::Weight`](crate::GeometryError::Weight) for a weight that is negative or not finite or a robust scale that is not positive.
    pub fn new(template: &TriangleMesh, camera: &Camera, points: &[ImagePoint], robust: Robust) -> Result<Self> {
        check_robust("reprojection", robust)?;
        points.iter().try_for_each(|p| check_weight("reprojection", p.weight))?;
        let seen = points.iter().filter(|p| p.pixel.is_finite());
        let kept = |p: &ImagePoint| Some((AnchoredPoint::new(template, p.point)?, p.pixel, p.weight));
        Ok(Self {
            camera: *camera,
            points: seen.filter_map(kept).collect(),
            robust,
        })
    }
}

impl Energy for Reprojection {
    fn name(&self) -> &'static str {
        "reprojection"
    }

    fn energy(&self, vertices: &[DVec3]) -> f64 {
        let cost = |(point, pixel, weight): &(AnchoredPoint, DVec2, f64)| {
            let projected = self.camera.project(point.position(vertices));
            let error = projected.map_or(LARGEST_ERROR_PX, |p| p.distance(*pixel).min(LARGEST_ERROR_PX));
            weight * self.robust.rho(error * error)
        };
        self.points.iter().map(cost).sum()
    }

    fn linearize(&self, vertices: &[DVec3], sink: &mut dyn ResidualSink) {
        for (point, pixel, weight) in &self.points {
            if let Some((projected, gradients)) = self.camera.project_with_gradients(point.position(vertices)) {
                let residual = projected - *pixel;
                let weight = weight * self.robust.weight(residual.length_squared());
                for (residual, gradient) in residual.to_array().into_iter().zip(gradients) {
                    sink.scalar(residual, weight, &point.spread(gradient));
                }
            }
        }
    }
}
