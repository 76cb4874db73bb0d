//! How sure the place of a fitted mesh is.

use super::close_up::CloseUp;
use super::mesh_fitter::{FitRound, MeshFitter, Resolution};
use super::observation::Observation;
use crate::error::GeometryError;
use crate::surface::Surface;
use glam::{DMat3, DVec3};

/// Variance of the fit's residuals, in units of its energy: chosen such that two thirds of the vertices of painted prints lie within one
/// stated deviation.
const VARIANCE: f64 = 0.3;

/// Steps of the power method, which finds the longest axis of an ellipsoid: near ones are as good.
const POWER_STEPS: usize = 16;

/// The standard deviation of each vertex of a surface that `close_up` was compared with, mm, along the direction in which it is least
/// sure. It follows from the normal equations of the coarse mesh at its place (Gauss and Newton's approximation of the
/// posterior); isometry and bending are what is known of the sheet beforehand.
pub(super) fn deviations(
    fitter: &mut MeshFitter,
    close_up: &CloseUp,
    surface: &Surface,
) -> Result<Vec<f32>, GeometryError> {
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
    let (_, covariances) = fitter.round_and(observation, &coarse, &round, &[], |isometric, (_, terms), vertices| {
        isometric.covariances(terms, vertices)
    })?;
    let longest = |covariance: &DMat3| {
        let axis = (0..POWER_STEPS).fold(DVec3::ONE, |axis, _| (*covariance * axis).normalize_or_zero());
        (VARIANCE * axis.dot(*covariance * axis)).sqrt() as f32
    };
    let coarse: Option<Vec<_>> = covariances.map(|covariances| covariances.iter().map(longest).collect());
    Ok(coarse.map_or_else(Vec::new, |coarse| fitter.fine_scalars(&coarse)))
}
