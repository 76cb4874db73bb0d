//! Edge lengths as in the template.

use crate::error::GeometryError;
use crate::mesh::TriangleMesh;
use crate::solver::energy::{Energy, ResidualSink, check_weight, mean_edge_length};
use glam::DVec3;

/// Isometry: weight times the sum over edges of ((|p_i - p_j| - |q_i - q_j|) / mean edge length)^2. The
/// isometric deformation model of Shape-from-Template (Bartoli et al. 2015) on a mesh, as a cost.
#[derive(Clone, Debug)]
pub struct Isometry {
    /// Vertices of each edge, and the edge at rest.
    edges: Vec<([usize; 2], DVec3)>,
    lengths: Vec<f64>,
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
        let edges: Vec<_> = edges.map(|[a, b]| ([a, b], v[a] - v[b])).collect();
        Ok(Self {
            lengths: edges.iter().map(|(_, edge)| edge.length()).collect(),
            edges,
            weight,
            per_length: mean_edge_length(template)?.recip(),
        })
    }

    /// Takes the template for one whose x is longer by `aspect` / 2, and whose y is shorter by as much (ln).
    pub(crate) fn set_aspect(&mut self, aspect: f64) {
        let stretch = DVec3::new(0.5 * aspect, -0.5 * aspect, 0.0).exp();
        for (length, (_, edge)) in self.lengths.iter_mut().zip(&self.edges) {
            *length = (stretch * *edge).length();
        }
    }

    /// As [`Energy::linearize`]: residual, weight, its derivative with respect to the aspect, and those with respect to vertices.
    pub(crate) fn linearize_aspect(
        &self,
        vertices: &[DVec3],
        mut sink: impl FnMut(f64, f64, f64, [(usize, DVec3); 2]),
    ) {
        for (&(ends, edge), length) in self.edges.iter().zip(&self.lengths) {
            let along = (edge.x * edge.x - edge.y * edge.y) / edge.length_squared();
            let (residual, gradients) = self.residual(ends, *length, vertices);
            sink(
                residual,
                self.weight,
                -0.5 * along * length * self.per_length,
                gradients,
            );
        }
    }

    fn residual(&self, [a, b]: [usize; 2], rest: f64, vertices: &[DVec3]) -> (f64, [(usize, DVec3); 2]) {
        let edge = vertices[a] - vertices[b];
        // An edge of length zero has no direction to grow in.
        let gradient = edge.try_normalize().unwrap_or_default() * self.per_length;
        (
            (edge.length() - rest) * self.per_length,
            [(a, gradient), (b, -gradient)],
        )
    }
}

impl Energy for Isometry {
    fn name(&self) -> &'static str {
        "isometry"
    }

    fn energy(&self, vertices: &[DVec3]) -> f64 {
        let strain = |(([a, b], _), rest): (&([usize; 2], DVec3), &f64)| vertices[*a].distance(vertices[*b]) - rest;
        let strains = self.edges.iter().zip(&self.lengths).map(strain);
        self.weight * self.per_length * self.per_length * strains.map(|strain| strain * strain).sum::<f64>()
    }

    fn linearize(&self, vertices: &[DVec3], sink: &mut dyn ResidualSink) {
        for (&(ends, _), length) in self.edges.iter().zip(&self.lengths) {
            let (residual, gradients) = self.residual(ends, *length, vertices);
            sink.scalar(residual, self.weight, &gradients);
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
