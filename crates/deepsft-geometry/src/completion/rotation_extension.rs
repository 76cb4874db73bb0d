//! A first guess of the rotations of hidden cells: those of the visible part, extended.

use super::components::Components;
use super::stiffness::Stiffness;
use super::visible_points::Visible;
use crate::error::GeometryError;
use crate::mesh::nearest_rotation;
use crate::solver::arap_cells::ArapCells;
use glam::{DMat3, DQuat, DVec3};

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
) -> Result<Vec<DQuat>, GeometryError> {
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
