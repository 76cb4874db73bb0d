//! Visible vertices at measured 3D points: the paper's E_data.

use crate::error::GeometryError;
use crate::mesh::TriangleMesh;
use crate::solver::checked::{check_weight, vertex_in};
use crate::solver::energy::{Energy, ResidualSink};
use crate::solver::length_scale::LengthScale;
use glam::DVec3;

/// A vertex seen at a point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VertexPoint {
    /// Index of the template's vertex.
    pub vertex: usize,
    /// Where it is seen, camera frame, in the template's unit. A measurement that is not finite (a hole in
    /// the depth map) counts as not seen.
    pub p_camera: DVec3,
    /// Its weight; the paper has 1.
    pub weight: f64,
}

/// E_data of the paper's equation `arap`: the sum over visible vertices of w |p_i - x_i|^2, lengths divided
/// by the mean edge length.
#[derive(Clone, Debug)]
pub struct PointData {
    points: Vec<VertexPoint>,
    per_length: f64,
}

impl PointData {
    /// Takes the points of one frame. Points that are not finite are left out.
    ///
    /// # Errors
    /// [`GeometryError::VertexIndex`] for a vertex that `template` lacks, [`GeometryError::Weight`] for a
    /// weight that is negative or not finite.
    pub fn new(template: &TriangleMesh, scale: LengthScale, points: &[VertexPoint]) -> Result<Self, GeometryError> {
        let vertices = template.vertices().len();
        for point in points {
            vertex_in(point.vertex, vertices)?;
            check_weight("point data", point.weight)?;
        }
        Ok(Self {
            points: points.iter().copied().filter(|p| p.p_camera.is_finite()).collect(),
            per_length: scale.get().recip(),
        })
    }
}

impl Energy for PointData {
    fn name(&self) -> &'static str {
        "point data"
    }

    fn stencils(&self, visit: &mut dyn FnMut(&[usize])) {
        self.points.iter().for_each(|p| visit(&[p.vertex]));
    }

    fn energy(&self, vertices: &[DVec3]) -> f64 {
        let square = |p: &VertexPoint| p.weight * vertices[p.vertex].distance_squared(p.p_camera);
        self.points.iter().map(square).sum::<f64>() * self.per_length * self.per_length
    }

    fn linearize(&self, vertices: &[DVec3], sink: &mut dyn ResidualSink) {
        for p in &self.points {
            let residual = (vertices[p.vertex] - p.p_camera) * self.per_length;
            sink.vector(residual, p.weight, &[(p.vertex, self.per_length)]);
        }
    }
}
