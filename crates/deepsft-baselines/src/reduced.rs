//! Energies of a mesh whose vertices are linear combinations of a few control vertices.

use deepsft_geometry::glam::DVec3;
use deepsft_geometry::solver::{Energy, ResidualSink};
use faer::Mat;

/// An energy of the vertices x = P c as one of the control vertices c.
pub struct Reduced<'a> {
    /// The energy of all vertices.
    pub term: &'a dyn Energy,
    /// P: a row per vertex, a column per control vertex.
    pub projection: &'a Mat<f64>,
}

/// The vertices of which `controls` are the control vertices.
pub fn expanded(projection: &Mat<f64>, controls: &[DVec3]) -> Vec<DVec3> {
    let vertex = |row: usize| (0..controls.len()).map(|k| projection[(row, k)] * controls[k]).sum();
    (0..projection.nrows()).map(vertex).collect()
}

impl Energy for Reduced<'_> {
    fn name(&self) -> &'static str {
        self.term.name()
    }

    fn stencils(&self, visit: &mut dyn FnMut(&[usize])) {
        // Every control vertex moves every vertex a little.
        visit(&(0..self.projection.ncols()).collect::<Vec<_>>());
    }

    fn energy(&self, controls: &[DVec3]) -> f64 {
        self.term.energy(&expanded(self.projection, controls))
    }

    fn linearize(&self, controls: &[DVec3], sink: &mut dyn ResidualSink) {
        let projection = self.projection;
        self.term
            .linearize(&expanded(projection, controls), &mut ReducedSink { sink, projection });
    }
}

struct ReducedSink<'a> {
    sink: &'a mut dyn ResidualSink,
    projection: &'a Mat<f64>,
}

impl ResidualSink for ReducedSink<'_> {
    fn scalar(&mut self, residual: f64, weight: f64, gradient: &[(usize, DVec3)]) {
        let of = |control: usize| gradient.iter().map(|&(v, g)| self.projection[(v, control)] * g).sum();
        let reduced: Vec<(usize, DVec3)> = (0..self.projection.ncols()).map(|k| (k, of(k))).collect();
        self.sink.scalar(residual, weight, &reduced);
    }

    fn vector(&mut self, residual: DVec3, weight: f64, coefficients: &[(usize, f64)]) {
        let of = |k: usize| coefficients.iter().map(|&(v, c)| self.projection[(v, k)] * c).sum();
        let reduced: Vec<(usize, f64)> = (0..self.projection.ncols()).map(|k| (k, of(k))).collect();
        self.sink.vector(residual, weight, &reduced);
    }
}
