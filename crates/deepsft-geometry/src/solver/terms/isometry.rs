//! Edge lengths as in the template.

use crate::error::GeometryError;
use crate::mesh::TriangleMesh;
use crate::solver::checked::check_weight;
use crate::solver::energy::{Energy, ResidualSink};
use crate::solver::mean_edge_length::mean_edge_length;
use glam::DVec3;

/// Isometry: weight times the sum over edges of ((|p_i - p_j| - |q_i - q_j|) / mean edge length)^2. The
/// isometric deformation model of Shape-from-Template (Bartoli et al. 2015) on a mesh, as a cost.
#[derive(Clone, Debug)]
pub struct Isometry {
    /// Vertices and rest length of each edge.
    edges: Vec<([usize; 2], f64)>,
    weight: f64,
    per_length: f64,
}

impl Isometry {
    /// For the edges of `template`. With point or image data of weight 1 a sheet of paper wants 1e2 to 1e4.
    ///
    /// # Errors
    /// [`GeometryError::Weight`] for a weight that is negative or not finite, [`GeometryError::MeshWithoutExtent`].
    pub fn new(template: &TriangleMesh, weight: f64) -> Result<Self, GeometryError> {
        check_weight("isometry", weight)?;
        let v = template.vertices();
        let edges = template.edges().into_iter().filter(|[a, b]| a != b);
        Ok(Self {
            edges: edges.map(|[a, b]| ([a, b], v[a].distance(v[b]))).collect(),
            weight,
            per_length: mean_edge_length(template)?.recip(),
        })
    }
}

impl Energy for Isometry {
    fn name(&self) -> &'static str {
        "isometry"
    }

    fn energy(&self, vertices: &[DVec3]) -> f64 {
        let strain = |([a, b], rest): &([usize; 2], f64)| (vertices[*a].distance(vertices[*b]) - rest).powi(2);
        self.weight * self.per_length * self.per_length * self.edges.iter().map(strain).sum::<f64>()
    }

    fn linearize(&self, vertices: &[DVec3], sink: &mut dyn ResidualSink) {
        for &([a, b], rest) in &self.edges {
            let edge = vertices[a] - vertices[b];
            let length = edge.length();
            // An edge of length zero has no direction to grow in.
            let gradient = edge.try_normalize().unwrap_or_default() * self.per_length;
            let residual = (length - rest) * self.per_length;
            sink.scalar(residual, self.weight, &[(a, gradient), (b, -gradient)]);
        }
    }

    fn add_curvature(&self, vertices: &[DVec3], velocity: &[DVec3], gradient: &mut [DVec3]) {
        let factor = self.weight * self.per_length * self.per_length;
        for &([a, b], _) in &self.edges {
            let edge = vertices[a] - vertices[b];
            let length = edge.length();
            let Some(direction) = edge.try_normalize() else {
                continue;
            };
            // |e + t v| has the second derivative |v across e|^2 / |e|.
            let across = (velocity[a] - velocity[b]).reject_from_normalized(direction);
            let pull = factor * across.length_squared() / length * direction;
            gradient[a] += pull;
            gradient[b] -= pull;
        }
    }
}
