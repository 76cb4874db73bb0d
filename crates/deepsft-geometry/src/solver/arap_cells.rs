//! As-rigid-as-possible cells of a template.

use super::terms::cotangent;
use crate::mesh::{TriangleMesh, nearest_rotation};
use glam::{DMat3, DQuat, DVec3};
use std::ops::Range;

/// Cotangent weights are kept between these. The lower bound keeps obtuse and degenerate faces from
/// making the energy indefinite or a vertex loose (a square grid's diagonals have weight 0); the upper one
/// is a needle of half a degree.
const WEIGHT_BOUNDS: [f64; 2] = [1e-4, 1e2];

/// The cells of Sorkine and Alexa 2007: each vertex with its edges, cotangent weights and rest
/// edges, with E_arap and E_smooth of the paper on them:
///
/// * E_arap = sum over i, sum over neighbours j of w_ij |e_ij - R_i q_ij|^2 with e_ij = p_i - p_j and q_ij
///   the same at rest,
/// * E_smooth = sum over i of (1 / d_i) |sum over j of w_ij (e_ij - R_i q_ij)|^2 with d_i the sum of w_ij:
///   the deviation of the cotangent Laplacian, hence of the mean curvature normal, from the template's,
///   rotated along. The paper names such a term and not its formula; this is our choice. By
///   Cauchy-Schwarz it is at most E_arap.
///
/// The rotations R_i are the best for the weighted sum of both, so the gradient below is exact.
#[derive(Clone, Debug)]
pub(crate) struct ArapCells {
    /// Neighbours of vertex i: `neighbours[starts[i]..starts[i + 1]]`.
    starts: Vec<usize>,
    neighbours: Vec<usize>,
    weights: Vec<f64>,
    rest: Vec<DVec3>,
    /// d_i: the sum of a vertex's weights.
    pub(crate) degrees: Vec<f64>,
    /// Sum of w_ij q_ij over j.
    rest_sums: Vec<DVec3>,
    max_neighbours: usize,
    pub(crate) arap: f64,
    pub(crate) smoothness: f64,
}

/// Where the cells' rotations come from.
pub(crate) enum Rotations<'a> {
    /// The best, searched from the cell before, and left here, one per vertex.
    First(&'a mut [DQuat]),
    /// The best, searched from these, one per vertex, which are left with them.
    BestFrom(&'a mut [DQuat]),
    /// These.
    Held(&'a [DQuat]),
}

impl ArapCells {
    /// For the edges of `template` with weights `arap` and `smoothness` of the two energies.
    pub(crate) fn new(template: &TriangleMesh, arap: f64, smoothness: f64) -> Self {
        let v = template.vertices();
        let mut half_edges: Vec<([usize; 2], f64)> = Vec::with_capacity(6 * template.faces().len());
        for &[a, b, c] in template.faces() {
            for (i, j, k) in [(a, b, c), (b, c, a), (c, a, b)] {
                let half = cotangent(v[k], v[i], v[j]).map_or(0.0, |(cotangent, _)| 0.5 * cotangent);
                half_edges.extend([([i, j], half), ([j, i], half)]);
            }
        }
        half_edges.retain(|([i, j], _)| i != j);
        Self::of_half_edges(v, half_edges, arap, smoothness)
    }

    /// For `edges` between `points`, all of one weight for a unit of squared length.
    pub(crate) fn of_edges(points: &[DVec3], edges: &[[usize; 2]], arap: f64) -> Self {
        let square = |[a, b]: &[usize; 2]| points[*a].distance_squared(points[*b]);
        let mean = edges.iter().map(square).sum::<f64>() / edges.len() as f64;
        let weighed = edges.iter().flat_map(|edge @ &[a, b]| {
            let weight = mean / square(edge);
            [([a, b], weight), ([b, a], weight)]
        });
        Self::of_half_edges(points, weighed.collect(), arap, 0.0)
    }

    fn of_half_edges(v: &[DVec3], mut half_edges: Vec<([usize; 2], f64)>, arap: f64, smoothness: f64) -> Self {
        half_edges.sort_unstable_by_key(|h| h.0);
        let (mut from, mut neighbours, mut weights, mut rest) = (vec![], vec![], vec![], vec![]);
        for same in half_edges.chunk_by(|a, b| a.0 == b.0) {
            let [i, j] = same[0].0;
            let sum: f64 = same.iter().map(|h| h.1).sum();
            from.push(i);
            neighbours.push(j);
            weights.push(sum.clamp(WEIGHT_BOUNDS[0], WEIGHT_BOUNDS[1]));
            rest.push(v[i] - v[j]);
        }
        let start = |i: usize| from.partition_point(|&vertex| vertex < i);
        let starts: Vec<usize> = (0..=v.len()).map(start).collect();
        let cells = || starts.windows(2).map(|cell| cell[0]..cell[1]);
        let degrees = cells().map(|cell| weights[cell].iter().sum()).collect();
        let rest_sum = |cell: Range<usize>| {
            let edges = weights[cell.clone()].iter().zip(&rest[cell]);
            edges.map(|(w, q)| *w * *q).sum()
        };
        let rest_sums = cells().map(rest_sum).collect();
        let max_neighbours = cells().map(|cell| cell.len()).max().unwrap_or(0);
        Self {
            degrees,
            rest_sums,
            max_neighbours,
            starts,
            neighbours,
            weights,
            rest,
            arap,
            smoothness,
        }
    }

    pub(crate) fn vertices(&self) -> usize {
        self.degrees.len()
    }

    /// Neighbours of a vertex, the weights of the edges to them, and the rest edges q_ij.
    pub(crate) fn edges(&self, i: usize) -> impl Iterator<Item = (usize, f64, DVec3)> + '_ {
        let edges = self.starts[i]..self.starts[i + 1];
        edges.map(|k| (self.neighbours[k], self.weights[k], self.rest[k]))
    }

    /// The best rotation of cell `i` with deformed edges `edges`, searched from `guess`.
    fn rotation(&self, i: usize, weights: &[f64], edges: &[DVec3], rest: &[DVec3], guess: DQuat) -> DQuat {
        let mut covariance = DMat3::ZERO;
        let mut edge_sum = DVec3::ZERO;
        for ((q, weight), edge) in rest.iter().zip(weights).zip(edges) {
            let e = *weight * *edge;
            covariance += DMat3::from_cols(e * q.x, e * q.y, e * q.z);
            edge_sum += e;
        }
        covariance *= self.arap;
        if self.smoothness > 0.0 && self.degrees[i] > 0.0 {
            let (e, q) = (edge_sum * (self.smoothness / self.degrees[i]), self.rest_sums[i]);
            covariance += DMat3::from_cols(e * q.x, e * q.y, e * q.z);
        }
        nearest_rotation(covariance, guess)
    }

    pub(crate) fn rotations(&self, vertices: &[DVec3]) -> Vec<DQuat> {
        let mut rotation = DQuat::IDENTITY;
        let of_cell = |(i, vertex): (usize, &DVec3)| {
            let cell = self.starts[i]..self.starts[i + 1];
            let edges = self.neighbours[cell.clone()].iter().map(|&j| *vertex - vertices[j]);
            let edges: Vec<DVec3> = edges.collect();
            rotation = self.rotation(i, &self.weights[cell.clone()], &edges, &self.rest[cell], rotation);
            rotation
        };
        vertices.iter().enumerate().map(of_cell).collect()
    }

    /// Adds half the gradient of arap E_arap + smoothness E_smooth to `gradient`. Returns both energies without their weights.
    pub(crate) fn add_gradient(
        &self,
        vertices: &[DVec3],
        mut rotations: Rotations<'_>,
        gradient: &mut [DVec3],
    ) -> [f64; 2] {
        let (mut arap, mut smoothness) = (0.0, 0.0);
        let mut buffer = vec![DVec3::ZERO; self.max_neighbours];
        let mut rotation = DQuat::IDENTITY;
        for (i, &vertex) in vertices.iter().enumerate() {
            let cell = self.starts[i]..self.starts[i + 1];
            let (neighbours, weights) = (&self.neighbours[cell.clone()], &self.weights[cell.clone()]);
            let rest = &self.rest[cell];
            // First the edges e_ij, then what the rotation leaves of them.
            let edges = &mut buffer[..neighbours.len()];
            for (edge, &j) in edges.iter_mut().zip(neighbours) {
                *edge = vertex - vertices[j];
            }
            rotation = match &rotations {
                Rotations::First(_) => self.rotation(i, weights, edges, rest, rotation),
                Rotations::BestFrom(guesses) => self.rotation(i, weights, edges, rest, guesses[i]),
                Rotations::Held(held) => held[i],
            };
            if let Rotations::First(best) | Rotations::BestFrom(best) = &mut rotations {
                best[i] = rotation;
            }
            let matrix = DMat3::from_quat(rotation);
            let mut sum = DVec3::ZERO;
            for ((edge, q), &weight) in edges.iter_mut().zip(rest).zip(weights) {
                *edge -= matrix * *q;
                arap += weight * edge.length_squared();
                sum += weight * *edge;
            }
            let mut mean = DVec3::ZERO;
            if self.degrees[i] > 0.0 {
                smoothness += sum.length_squared() / self.degrees[i];
                mean = sum * (self.smoothness / self.degrees[i]);
            }
            let mut pulls = DVec3::ZERO;
            for ((&j, &weight), residual) in neighbours.iter().zip(weights).zip(&*edges) {
                let pull = weight * (self.arap * *residual + mean);
                pulls += pull;
                gradient[j] -= pull;
            }
            gradient[i] += pulls;
        }
        [arap, smoothness]
    }
}
