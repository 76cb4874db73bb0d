//! Connected components of a mesh, and what holds each in place.

use crate::mesh::{DisjointSets, RigidMotion};
use crate::solver::arap_cells::ArapCells;
use glam::DVec3;

/// Which component each vertex belongs to.
#[derive(Debug)]
pub(super) struct Components {
    of_vertex: Vec<usize>,
    count: usize,
}

impl Components {
    /// Of the cells' edges; a vertex without edges is a component of its own.
    pub(super) fn of(prior: &ArapCells) -> Self {
        let mut sets = DisjointSets::new(prior.vertices());
        for i in 0..prior.vertices() {
            prior.edges(i).for_each(|(j, ..)| sets.join(i, j));
        }
        let (of_vertex, count) = sets.numbered();
        Self { of_vertex, count }
    }

    /// `from` moved rigidly onto `points`, each component by itself; a hidden vertex has the weight 0. What the points
    /// of a component leave open is taken from the motion of all.
    pub(super) fn align(&self, from: &[DVec3], points: &[DVec3], weights: &[f64]) -> Vec<DVec3> {
        let seen = (0..from.len()).filter(|&i| weights[i] > 0.0);
        let pair = |i: usize| (from[i], points[i], weights[i]);
        let whole = RigidMotion::align(seen.clone().map(pair), RigidMotion::IDENTITY);
        // One pass sorts the visible vertices by component: there may be many.
        let mut members: Vec<Vec<(DVec3, DVec3, f64)>> = vec![Vec::new(); self.count];
        seen.for_each(|i| members[self.of_vertex[i]].push(pair(i)));
        let motion = |pairs: &Vec<_>| RigidMotion::align(pairs.iter().copied(), whole);
        let motions: Vec<RigidMotion> = match &members[..] {
            [_] => vec![whole],
            _ => members.iter().map(motion).collect(),
        };
        let moved = |(&p, &component): (&DVec3, &usize)| motions[component].apply(p);
        from.iter().zip(&self.of_vertex).map(moved).collect()
    }

    /// `holds`, completed so that each component has something: one vertex of each that has nothing is tied to where
    /// it is with `tie`.
    pub(super) fn tie(&self, mut holds: Vec<f64>, tie: f64) -> Vec<f64> {
        let mut tied = vec![false; self.count];
        for (hold, &component) in holds.iter().zip(&self.of_vertex) {
            tied[component] |= *hold > 0.0;
        }
        for (hold, &component) in holds.iter_mut().zip(&self.of_vertex) {
            if !std::mem::replace(&mut tied[component], true) {
                *hold = tie;
            }
        }
        holds
    }
}
