//! A lattice around a solid that moves its vertices: few unknowns, however fine the mesh is.

use crate::mesh::{RigidMotion, TriangleMesh};
use crate::solver::{Energy, ResidualSink};
use glam::{DVec3, IVec3};
use std::collections::{BTreeSet, HashMap};
use std::iter::Sum;
use std::ops::Mul;

/// Cells along the longest side.
const CELLS: f64 = 6.0;

/// Rounds in which nodes are brought to where vertices are.
const ROUNDS: usize = 20;

/// Corners of a cell.
const CORNERS: usize = 8;

/// Nodes of the cells of a lattice in which a mesh has vertices. A vertex is the trilinear mean of its cell's corners (embedded
/// deformation: Sumner, Schmid and Pauly 2007, with a lattice for the graph).
#[derive(Debug)]
pub(crate) struct Cage {
    /// At rest.
    pub(crate) nodes: Vec<DVec3>,
    /// Pairs of nodes that share a cell.
    pub(crate) edges: Vec<[usize; 2]>,
    /// Of each vertex: nodes and their weights, which sum to 1.
    weights: Vec<[(usize, f64); CORNERS]>,
}

impl Cage {
    /// Around the vertices of `mesh`, which has its rest shape.
    pub(crate) fn around(mesh: &TriangleMesh) -> Self {
        let vertices = mesh.vertices();
        let low = vertices.iter().copied().fold(DVec3::INFINITY, DVec3::min);
        let high = vertices.iter().copied().fold(DVec3::NEG_INFINITY, DVec3::max);
        let side = (high - low).max_element() / CELLS;
        let mut numbers: HashMap<IVec3, usize> = HashMap::new();
        let (mut nodes, mut edges) = (Vec::new(), BTreeSet::new());
        let mut weights = Vec::with_capacity(vertices.len());
        for p in vertices {
            let at = (p - low) / side;
            let cell = at.floor().min(DVec3::splat(CELLS - 1.0));
            let fraction = at - cell;
            let of_corner = |k: usize| {
                let step = IVec3::new((k & 1) as i32, (k >> 1 & 1) as i32, (k >> 2) as i32);
                let corner = cell.as_ivec3() + step;
                let number = *numbers.entry(corner).or_insert_with(|| {
                    nodes.push(low + corner.as_dvec3() * side);
                    nodes.len() - 1
                });
                let near = step.as_dvec3();
                (
                    number,
                    (near * fraction + (1.0 - near) * (1.0 - fraction)).element_product(),
                )
            };
            let corners: [(usize, f64); CORNERS] = [0, 1, 2, 3, 4, 5, 6, 7].map(of_corner);
            for (k, (a, _)) in corners.iter().enumerate() {
                edges.extend(corners[k + 1..].iter().map(|(b, _)| [*a.min(b), *a.max(b)]));
            }
            weights.push(corners);
        }
        Self {
            edges: edges.into_iter().collect(),
            nodes,
            weights,
        }
    }

    /// The pairs of nodes that a residual over a face of `mesh`, whose vertices these are, may couple.
    pub(crate) fn couplings(&self, mesh: &TriangleMesh) -> Vec<[usize; 2]> {
        let mut pairs: BTreeSet<[usize; 2]> = self.edges.iter().copied().collect();
        for face in mesh.faces() {
            let nodes: BTreeSet<_> = face.iter().flat_map(|&v| self.weights[v].map(|w| w.0)).collect();
            let nodes: Vec<usize> = nodes.into_iter().collect();
            for (k, &a) in nodes.iter().enumerate() {
                pairs.extend(nodes[k + 1..].iter().map(|&b| [a, b]));
            }
        }
        pairs.into_iter().collect()
    }

    /// Of each vertex the weighted mean of what its nodes have: of their places, where they move it.
    pub(crate) fn interpolated<T: Copy + Mul<f64, Output = T> + Sum>(&self, of_nodes: &[T]) -> Vec<T> {
        let mean = |weights: &[(usize, f64); CORNERS]| weights.iter().map(|&(node, w)| of_nodes[node] * w).sum();
        self.weights.iter().map(mean).collect()
    }

    /// The nodes with which the vertices are about at `vertices`: those of the rigid shape, brought nearer round by round.
    pub(crate) fn nodes_of(&self, vertices: &[DVec3]) -> Vec<DVec3> {
        let here = self.interpolated(&self.nodes);
        let pairs = here.iter().zip(vertices).map(|(&p, &q)| (p, q, 1.0));
        let motion = RigidMotion::align(pairs, RigidMotion::IDENTITY);
        let mut nodes: Vec<DVec3> = self.nodes.iter().map(|&p| motion.apply(p)).collect();
        for _ in 0..ROUNDS {
            let here = self.interpolated(&nodes);
            let mut sums = vec![(DVec3::ZERO, 0.0); nodes.len()];
            for ((p, q), weights) in here.iter().zip(vertices).zip(&self.weights) {
                for &(node, w) in weights {
                    sums[node].0 += w * (q - p);
                    sums[node].1 += w;
                }
            }
            for (node, (way, weight)) in nodes.iter_mut().zip(sums) {
                *node += way / weight.max(f64::MIN_POSITIVE);
            }
        }
        nodes
    }
}

/// A term over vertices, as one over the nodes that move them.
pub(crate) struct Embedded<'a> {
    pub(crate) term: &'a dyn Energy,
    pub(crate) cage: &'a Cage,
}

impl Energy for Embedded<'_> {
    fn name(&self) -> &'static str {
        self.term.name()
    }

    fn energy(&self, nodes: &[DVec3]) -> f64 {
        self.term.energy(&self.cage.interpolated(nodes))
    }

    fn linearize(&self, nodes: &[DVec3], sink: &mut dyn ResidualSink) {
        let (cage, gathered) = (self.cage, Vec::new());
        let mut chained = Chained { cage, sink, gathered };
        self.term.linearize(&cage.interpolated(nodes), &mut chained);
    }
}

/// Hands on residuals of vertices as residuals of nodes (the chain rule).
struct Chained<'a> {
    cage: &'a Cage,
    sink: &'a mut dyn ResidualSink,
    gathered: Vec<(usize, DVec3)>,
}

impl Chained<'_> {
    fn gather(&mut self, vertices: impl Iterator<Item = (usize, DVec3)>) {
        self.gathered.clear();
        for (vertex, gradient) in vertices {
            for &(node, w) in &self.cage.weights[vertex] {
                match self.gathered.iter_mut().find(|(known, _)| *known == node) {
                    Some((_, sum)) => *sum += gradient * w,
                    None => self.gathered.push((node, gradient * w)),
                }
            }
        }
    }
}

impl ResidualSink for Chained<'_> {
    fn scalar(&mut self, residual: f64, weight: f64, gradient: &[(usize, DVec3)]) {
        self.gather(gradient.iter().copied());
        self.sink.scalar(residual, weight, &self.gathered);
    }

    fn vector(&mut self, residual: DVec3, weight: f64, coefficients: &[(usize, f64)]) {
        self.gather(coefficients.iter().map(|&(vertex, c)| (vertex, DVec3::splat(c))));
        let of_nodes: Vec<_> = self.gathered.iter().map(|&(node, c)| (node, c.x)).collect();
        self.sink.vector(residual, weight, &of_nodes);
    }
}
