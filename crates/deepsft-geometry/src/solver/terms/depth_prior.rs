//! Depth measured at points of the template.

use crate::error::Result;
use crate::mesh::{AnchoredPoint, SurfacePoint, TriangleMesh};
use crate::solver::energy::{Energy, ResidualSink, Robust, check_robust, check_scale, check_weight};
use glam::DVec3;

/// The depth of a template point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PointDepth {
    /// The point on the template.
    pub point: SurfacePoint,
    /// Its camera-frame z, in the template's unit. A depth that is not finite counts as not measured.
    pub depth: f64,
    /// Standard deviation of the measurement, in the template's unit.
    pub deviation: f64,
}

/// The network's depth as a prior: the sum of weight rho(((z - depth) / deviation)^2), residuals in
/// standard deviations. Our addition: the paper takes the network's depth as it is.
#[derive(Clone, Debug)]
pub struct DepthPrior {
    points: Vec<(AnchoredPoint, f64, f64)>,
    weight: f64,
    robust: Robust,
}

impl DepthPrior {
    /// Takes the depths of one frame; `robust` has its scale in standard deviations. Depths that are not
    /// finite or lie on no face, or on one that names a vertex twice, are left out.
    ///
    /// # Errors
    /// [`GeometryError::Weight`](crate::GeometryError::Weight) for a weight, deviation or scale that cannot be one.
    pub fn new(template: &TriangleMesh, points: &[PointDepth], weight: f64, robust: Robust) -> Result<Self> {
        check_weight("depth prior", weight)?;
        check_robust("depth prior", robust)?;
        points
            .iter()
            .try_for_each(|p| check_scale("depth prior", p.deviation))?;
        let measured = points.iter().filter(|p| p.depth.is_finite());
        let kept = |p: &PointDepth| Some((AnchoredPoint::new(template, p.point)?, p.depth, p.deviation.recip()));
        Ok(Self {
            points: measured.filter_map(kept).collect(),
            weight,
            robust,
        })
    }
}

impl Energy for DepthPrior {
    fn name(&self) -> &'static str {
        "depth prior"
    }

    fn energy(&self, vertices: &[DVec3]) -> f64 {
        let cost = |(point, depth, per_deviation): &(AnchoredPoint, f64, f64)| {
            let residual = (point.position(vertices).z - depth) * per_deviation;
            self.robust.rho(residual * residual)
        };
        self.weight * self.points.iter().map(cost).sum::<f64>()
    }

    fn linearize(&self, vertices: &[DVec3], sink: &mut dyn ResidualSink) {
        for (point, depth, per_deviation) in &self.points {
            let residual = (point.position(vertices).z - depth) * per_deviation;
            let weight = self.weight * self.robust.weight(residual * residual);
            sink.scalar(residual, weight, &point.spread(*per_deviation * DVec3::Z));
        }
    }
}
