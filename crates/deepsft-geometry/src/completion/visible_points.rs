//! The visible vertices of one frame, welded.

use crate::error::GeometryError;
use crate::mesh::Welding;
use crate::solver::checked::check_weight;
use glam::DVec3;

/// A vertex seen at a point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VertexPoint {
    /// Index of the template's vertex. One that is not there counts as not seen.
    pub vertex: usize,
    /// Where it is seen, camera frame, in the template's unit. A measurement that is not finite (a hole in
    /// the depth map) counts as not seen.
    pub p_camera: DVec3,
    /// Its weight; the paper has 1.
    pub weight: f64,
}

/// Visible welded vertices of one frame: weight (0 when hidden) and weighted mean point of each vertex.
pub(super) struct Visible {
    pub(super) weights: Vec<f64>,
    pub(super) points: Vec<DVec3>,
}

impl Visible {
    /// From the points of vertices of the original mesh.
    pub(super) fn of(points: &[VertexPoint], welding: &Welding) -> Result<Self, GeometryError> {
        let n = welding.mesh().vertices().len();
        let mut visible = Self {
            weights: vec![0.0; n],
            points: vec![DVec3::ZERO; n],
        };
        for point in points {
            check_weight("point data", point.weight)?;
            if let Some(vertex) = welding.welded(point.vertex).filter(|_| point.p_camera.is_finite()) {
                visible.weights[vertex] += point.weight;
                visible.points[vertex] += point.weight * point.p_camera;
            }
        }
        for (sum, &weight) in visible.points.iter_mut().zip(&visible.weights) {
            if weight > 0.0 {
                *sum /= weight;
            }
        }
        if visible.weights.iter().all(|&w| w <= 0.0) {
            return Err(GeometryError::NoVisibleVertex);
        }
        Ok(visible)
    }
}
