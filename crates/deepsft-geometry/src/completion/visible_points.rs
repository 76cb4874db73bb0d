//! What of a mesh is visible in one frame: its points, the components that they hold, and the rotations that they show.

use super::stiffness::Stiffness;
use crate::error::{GeometryError, Result};
use crate::mesh::{DisjointSets, RigidMotion, Welding, nearest_rotation};
use crate::solver::arap_cells::ArapCells;
use crate::solver::energy::check_weight;
use glam::{DMat3, DQuat, DVec3};

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
    pub(super) fn of(points: &[VertexPoint], welding: &Welding) -> Result<Self> {
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

/// Two rest edges span a plane when the square of the sine between them is above this: 6 degrees.
const MIN_SINE_SQUARED: f64 = 0.01;

/// A guess of all rotations: where visible neighbours show a cell's rotation it is taken, and the hidden
/// part continues it as a harmonic function does. (Local rotations alone carry a bend into the hidden
/// part by one ring of vertices per iteration.) `rigid` stands where nothing is shown. Leaves `matrix` factorised for
/// this purpose.
pub(super) fn extended_rotations(
    prior: &ArapCells,
    matrix: &mut Stiffness,
    components: &Components,
    visible: &Visible,
    rigid: &[DQuat],
) -> Result<Vec<DQuat>> {
    let mut rotations = rigid.to_vec();
    let mut holds = vec![0.0; rotations.len()];
    for i in 0..rotations.len() {
        if let Some(rotation) = shown_rotation(prior, i, visible, rigid[i]) {
            rotations[i] = rotation;
            // As stiff as the cell itself: what is seen is smoothed over about one edge.
            holds[i] = matrix.diagonal(i);
        }
    }
    let holds = components.tie(holds, prior.arap);
    matrix.factorize(&holds)?;
    let mut blended = vec![DMat3::ZERO; rotations.len()];
    let mut columns = vec![DVec3::ZERO; rotations.len()];
    for axis in 0..3 {
        let held: Vec<DVec3> = (rotations.iter().zip(&holds))
            .map(|(r, hold)| *hold * DMat3::from_quat(*r).col(axis))
            .collect();
        matrix.solve(&held, &mut columns);
        for (blend, column) in blended.iter_mut().zip(&columns) {
            *blend.col_mut(axis) = *column;
        }
    }
    for (rotation, blend) in rotations.iter_mut().zip(blended) {
        *rotation = nearest_rotation(blend, *rotation);
    }
    Ok(rotations)
}

/// The rotation of cell `i` as its visible edges show it; `None` unless they span a plane at rest.
fn shown_rotation(prior: &ArapCells, i: usize, visible: &Visible, guess: DQuat) -> Option<DQuat> {
    if visible.weights[i] <= 0.0 {
        return None;
    }
    let mut covariance = DMat3::ZERO;
    let (mut first, mut spans) = (DVec3::ZERO, false);
    for (j, weight, q) in prior.edges(i).filter(|edge| visible.weights[edge.0] > 0.0) {
        let e = weight * (visible.points[i] - visible.points[j]);
        covariance += DMat3::from_cols(e * q.x, e * q.y, e * q.z);
        spans |= first.cross(q).length_squared() > MIN_SINE_SQUARED * first.length_squared() * q.length_squared();
        if first == DVec3::ZERO {
            first = q;
        }
    }
    spans.then(|| nearest_rotation(covariance, guess))
}
