//! Connected components of a mesh, and what holds each in place.

use crate::mesh::{DisjointSets, RigidMotion};
use crate::solver::terms::arap_cells::ArapCells;
use glam::DVec3;

/// Which component each vertex belongs to.
#[derive(Debug)]
pub(super) struct Components {
    of_vertex: Vec<usize>,
    count: usize,
}

/// A component's shape moved rigidly onto its visible points.
pub(super) struct Aligned {
    /// All vertices.
    pub(super) vertices: Vec<DVec3>,
    /// Components whose orientation the points leave open.
    pub(super) unoriented: usize,
}

/// What holds each vertex in place.
pub(super) struct Holds {
    /// One per vertex.
    pub(super) of_vertex: Vec<f64>,
    /// Components that nothing held.
    pub(super) loose: usize,
}

impl Components {
    /// Of the cells' edges; a vertex without edges is a component of its own.
    pub(super) fn of(prior: &ArapCells) -> Self {
        let mut sets = DisjointSets::new(prior.vertices());
        for i in 0..prior.vertices() {
            prior.neighbours(i).for_each(|(j, _)| sets.join(i, j));
        }
        let (of_vertex, count) = sets.numbered();
        Self { of_vertex, count }
    }

    /// How many there are.
    pub(super) fn count(&self) -> usize {
        self.count
    }

    /// `from` moved rigidly onto `points`, each component by itself; a hidden vertex has the weight 0. What the points
    /// of a component leave open is taken from the motion of all.
    pub(super) fn align(&self, from: &[DVec3], points: &[DVec3], weights: &[f64]) -> Aligned {
        let pairs = (0..from.len())
            .filter(|&i| weights[i] > 0.0)
            .map(|i| (from[i], points[i], weights[i]));
        let whole = RigidMotion::align(pairs.clone(), RigidMotion::IDENTITY);
        if self.count == 1 {
            return Aligned {
                vertices: from.iter().map(|&p| whole.apply(p)).collect(),
                unoriented: usize::from(!spans_a_plane(pairs.map(|p| p.0))),
            };
        }
        // One pass sorts the visible vertices by component: there may be many.
        let mut members: Vec<Vec<(DVec3, DVec3, f64)>> = vec![Vec::new(); self.count];
        for i in (0..from.len()).filter(|&i| weights[i] > 0.0) {
            members[self.of_vertex[i]].push((from[i], points[i], weights[i]));
        }
        let motions: Vec<RigidMotion> = members
            .iter()
            .map(|m| RigidMotion::align(m.iter().copied(), whole))
            .collect();
        Aligned {
            vertices: (from.iter().zip(&self.of_vertex))
                .map(|(&p, &c)| motions[c].apply(p))
                .collect(),
            unoriented: members.iter().filter(|m| !spans_a_plane(m.iter().map(|p| p.0))).count(),
        }
    }

    /// `holds`, completed so that each component has something: one vertex of each that has nothing is tied to where
    /// it is with `tie`.
    pub(super) fn tie(&self, mut holds: Vec<f64>, tie: f64) -> Holds {
        let mut tied = vec![false; self.count];
        for (hold, &component) in holds.iter().zip(&self.of_vertex) {
            tied[component] |= *hold > 0.0;
        }
        let mut loose = 0;
        for (hold, &component) in holds.iter_mut().zip(&self.of_vertex) {
            if !tied[component] {
                tied[component] = true;
                loose += 1;
                *hold = tie;
            }
        }
        Holds {
            of_vertex: holds,
            loose,
        }
    }
}

/// Whether points are not all on one line: their farthest distance from the line through the two far ones
/// is above 1e-6 of its length.
fn spans_a_plane(points: impl Iterator<Item = DVec3> + Clone) -> bool {
    let Some(first) = points.clone().next() else {
        return false;
    };
    let far = points.clone().map(|p| p - first).fold(DVec3::ZERO, |m, d| {
        if d.length_squared() > m.length_squared() { d } else { m }
    });
    let length = far.length_squared();
    length > 0.0
        && points
            .map(|p| (p - first).cross(far).length())
            .any(|area| area > 1e-6 * length)
}
