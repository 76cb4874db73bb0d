//! How sure the place of a fitted mesh is.

use super::close_up::CloseUp;
use super::isometric_mesh::IsometricMesh;
use super::measurements::Observation;
use super::mesh_fitter::{FitRound, MeshFitter, Resolution};
use crate::error::Result;
use crate::solver::{Energy, ResidualSink};
use crate::surface::Surface;
use faer::linalg::solvers::DenseSolveCore;
use faer::{Mat, Side};
use glam::{DMat3, DVec3};

/// Variance of the fit's residuals, in units of its energy: chosen such that two thirds of the vertices of painted prints lie within one
/// stated deviation.
const VARIANCE: f64 = 0.3;

/// The same of the pose of a solid, and of its bends: chosen on box and tube, 24 frames each (seed 6 of `study solids`), bent and at rest.
const POSE_VARIANCE: f64 = 1.2;
const BEND_VARIANCE: f64 = 5.0;

/// Steps of the power method, which finds the longest axis of an ellipsoid: near ones are as good.
const POWER_STEPS: usize = 16;

/// The standard deviation of each vertex of a surface that `close_up` was compared with, mm, along the direction in which it is least
/// sure. It follows from the normal equations at its place (Gauss and Newton's approximation of the posterior). What is known of a sheet
/// beforehand is isometry and bending; a solid has a rigid pose, and bends beside it unless `is_rigid`.
pub(super) fn deviations(
    fitter: &mut MeshFitter,
    close_up: &CloseUp,
    surface: &Surface,
    is_rigid: bool,
) -> Result<Vec<f32>> {
    let observation = Observation::new(&close_up.grey, &close_up.camera)?;
    let coarse = fitter.coarse_vertices(&surface.vertices_camera);
    let trust = surface.is_hidden.iter().map(|hidden| if *hidden { 0.0 } else { 1.0 });
    let trust: Vec<f32> = trust.collect();
    let trust = (!trust.is_empty()).then(|| fitter.coarse_scalars(&trust));
    let round = FitRound {
        resolution: Resolution::Coarse,
        trusted: trust.as_ref().map(|trust| (&trust[..], 0.5)),
        ..close_up.judging()
    };
    let is_sheet = fitter.template.is_sheet();
    let (_, covariances) = fitter.round_and(
        observation,
        &coarse,
        &round,
        &[],
        |isometric, (image, terms), vertices| {
            if is_sheet {
                let covariances = isometric.covariances(terms, vertices)?;
                return Some(covariances.into_iter().map(|c| VARIANCE * c).collect::<Vec<_>>());
            }
            let mut covariances = pose_covariances(isometric, image, vertices)?;
            covariances.iter_mut().for_each(|c| *c *= POSE_VARIANCE);
            if !is_rigid {
                let bends = isometric.covariances(terms, vertices)?;
                let both = covariances.iter_mut().zip(bends);
                both.for_each(|(c, bend)| *c += BEND_VARIANCE * bend);
            }
            Some(covariances)
        },
    )?;
    let longest = |covariance: &DMat3| {
        let axis = (0..POWER_STEPS).fold(DVec3::ONE, |axis, _| (*covariance * axis).normalize_or_zero());
        axis.dot(*covariance * axis).sqrt() as f32
    };
    let coarse: Option<Vec<_>> = covariances.map(|covariances| covariances.iter().map(longest).collect());
    Ok(coarse.map_or_else(Vec::new, |coarse| fitter.fine_scalars(&coarse)))
}

/// The covariances of the places at `vertices` of a solid whose rigid pose `image` tells. `None` where it does not.
fn pose_covariances(isometric: &IsometricMesh, image: &dyn Energy, vertices: &[DVec3]) -> Option<Vec<DMat3>> {
    let centre = vertices.iter().sum::<DVec3>() / vertices.len() as f64;
    let welded = isometric.weld(vertices);
    let mut pose = PoseEquations {
        arms: welded.iter().map(|p| p - centre).collect(),
        normal: Mat::zeros(6, 6),
    };
    image.linearize(&welded, &mut pose);
    let covariance = pose.normal.llt(Side::Lower).ok()?.inverse();
    let block = |row: usize, column: usize| {
        DMat3::from_cols_array_2d(&std::array::from_fn(|j| {
            std::array::from_fn(|i| covariance[(row + i, column + j)])
        }))
    };
    let (moves, both, turns) = (block(0, 0), block(0, 3), block(3, 3));
    let of_vertex = |p: &DVec3| {
        // A turn by w moves it by w x arm.
        let arm = p - centre;
        let cross = DMat3::from_cols(DVec3::X.cross(arm), DVec3::Y.cross(arm), DVec3::Z.cross(arm));
        let mixed = both * cross.transpose();
        moves + mixed + mixed.transpose() + cross * turns * cross.transpose()
    };
    Some(vertices.iter().map(of_vertex).collect())
}

/// The normal equations of a shift and a turn about the middle.
struct PoseEquations {
    /// The vertices from there.
    arms: Vec<DVec3>,
    normal: Mat<f64>,
}

impl ResidualSink for PoseEquations {
    fn scalar(&mut self, _: f64, weight: f64, gradient: &[(usize, DVec3)]) {
        let shift: DVec3 = gradient.iter().map(|(_, g)| *g).sum();
        let turn: DVec3 = gradient.iter().map(|&(v, g)| self.arms[v].cross(g)).sum();
        let row = [shift.x, shift.y, shift.z, turn.x, turn.y, turn.z];
        for (i, a) in row.iter().enumerate() {
            for (j, b) in row.iter().enumerate() {
                self.normal[(i, j)] += weight * a * b;
            }
        }
    }

    fn vector(&mut self, _: DVec3, _: f64, _: &[(usize, f64)]) {
        // Photo-consistency has numbers only.
    }
}
