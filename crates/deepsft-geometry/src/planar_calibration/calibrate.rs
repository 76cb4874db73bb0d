//! From points of a flat target in several views to the camera.

use super::adjustment::{Adjustment, Solution};
use super::camera_model::{CameraModel, CameraParameter};
use super::homography::{focal_length, homography, pose};
use crate::camera::Camera;
use crate::error::GeometryError;
use glam::{DMat3, DVec2};

/// Fewest points of a view.
const MIN_POINTS: usize = 6;

/// Focal lengths that are tried as a start, fractions of the image's long side: from fisheyes to telephoto lenses.
const START_FOCALS: [f64; 4] = [0.3, 0.5, 0.8, 1.6];

/// Residuals above this many robust standard deviations belong to wrong points.
const WRONG_DEVIATIONS: f64 = 5.0;

/// Points are never wrong below this distance, pixels.
const NEVER_WRONG_PX: f64 = 0.5;

/// Standard deviation of the focal length, as a fraction of it, from which on the views do not hold it.
const FOCAL_DEVIATION: f64 = 0.02;

/// A photograph of the target.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PlanarView {
    /// Places on the target, mm in any frame of its plane, and where the image shows them, pixels.
    pub points: Vec<(DVec2, DVec2)>,
}

/// How well a view agrees with the calibration.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct PlanarViewReport {
    /// Root mean square of the distances between seen and computed places, pixels.
    pub rms_px: f64,
    /// Computed place less seen one, pixels, for each point; `None` for points that were left out as wrong.
    pub residuals_px: Vec<Option<DVec2>>,
}

/// A camera as [`calibrate`] finds it.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct PlanarCalibration {
    /// The camera.
    pub camera: Camera,
    /// What was solved for.
    pub model: CameraModel,
    /// What was found, with deviations.
    pub parameters: Vec<CameraParameter>,
    /// Root mean square of the distances between seen and computed places, pixels.
    pub rms_px: f64,
    /// The views, as given.
    pub views: Vec<PlanarViewReport>,
}

/// The camera of `size` (columns, rows) that saw `views` of a flat target: a start from Zhang's equations, then the least distances in
/// the image over camera and poses. Wrong points are left out. Without a `model` the one with the fewest parameters that
/// explains the views (Bayesian information criterion): they may not hold more. [`CameraModel::Fisheye`] is never chosen.
///
/// # Errors
/// * [`GeometryError::CalibrationViews`] for fewer than 3 views with at least 6 points each; for [`CameraModel::Focal`] 1.
/// * [`GeometryError::CalibrationUndetermined`] when the views leave the focal length open, for they are all parallel, or do not fit.
/// * [`GeometryError::CameraParameter`] for an empty image.
pub fn calibrate(
    views: &[PlanarView],
    size: (usize, usize),
    model: Option<CameraModel>,
) -> Result<PlanarCalibration, GeometryError> {
    let enough = views.iter().filter(|view| view.points.len() >= MIN_POINTS).count();
    let expected = if model == Some(CameraModel::Focal) { 1 } else { 3 };
    if enough < expected || enough < views.len() {
        return Err(GeometryError::CalibrationViews {
            actual: enough,
            expected,
        });
    }
    if let Some(model) = model {
        return calibrated(views, size, model);
    }
    let mut best: Option<(f64, PlanarCalibration)> = None;
    let mut last = None;
    for model in [
        CameraModel::Focal,
        CameraModel::Pinhole,
        CameraModel::Radial,
        CameraModel::Polynomial,
    ] {
        match calibrated(views, size, model) {
            Ok(found) => {
                let criterion = criterion(&found);
                if best.as_ref().is_none_or(|(least, _)| criterion < *least) {
                    best = Some((criterion, found));
                }
            }
            Err(error) => last = Some(error),
        }
    }
    match (best, last) {
        (Some((_, found)), _) => Ok(found),
        (None, Some(error)) => Err(error),
        (None, None) => Err(GeometryError::CalibrationUndetermined {
            deviation: f64::INFINITY,
        }),
    }
}

/// The Bayesian information criterion. Points left out count as if they were as wrong as those that are just kept: no model wins by
/// leaving out more.
fn criterion(found: &PlanarCalibration) -> f64 {
    let residuals = || found.views.iter().flat_map(|view| &view.residuals_px);
    let kept: f64 = residuals().flatten().map(|r| r.length_squared()).sum();
    let left_out = residuals().filter(|r| r.is_none()).count() as f64;
    let limit = NEVER_WRONG_PX.max(WRONG_DEVIATIONS * found.rms_px);
    let count = 2.0 * residuals().count() as f64;
    let unknowns = (found.parameters.len() + 6 * found.views.len()) as f64;
    count * ((kept + left_out * limit * limit) / count).ln() + unknowns * count.ln()
}

fn calibrated(
    views: &[PlanarView],
    size: (usize, usize),
    model: CameraModel,
) -> Result<PlanarCalibration, GeometryError> {
    let undetermined = GeometryError::CalibrationUndetermined {
        deviation: f64::INFINITY,
    };
    let mut counts: Vec<Vec<bool>> = views.iter().map(|view| vec![true; view.points.len()]).collect();
    let mut solution: Option<(f64, Solution)> = None;
    for camera in starts(views, size, model)? {
        let Some(poses) = views
            .iter()
            .map(|view| pose(&camera, &view.points))
            .collect::<Option<Vec<_>>>()
        else {
            continue;
        };
        let adjustment = Adjustment {
            model,
            views,
            counts: &counts,
            robust_px: 2.0,
        };
        let found = adjustment.solve(Solution { camera, poses });
        let spread = median_px(&residuals(views, &found));
        if solution.as_ref().is_none_or(|(least, _)| spread < *least) {
            solution = Some((spread, found));
        }
    }
    let (mut spread, mut solution) = solution.ok_or(undetermined)?;
    for _ in 0..3 {
        // The median distance of points with a deviation of 1 in both coordinates is 1.18.
        let limit = (WRONG_DEVIATIONS * spread / 1.18).max(NEVER_WRONG_PX);
        for (counts, residuals) in counts.iter_mut().zip(residuals(views, &solution)) {
            *counts = residuals.iter().map(|r| r.length() < limit).collect();
        }
        let few = counts
            .iter()
            .filter(|counts| counts.iter().filter(|c| **c).count() < MIN_POINTS)
            .count();
        if few > 0 {
            let actual = views.len() - few;
            return Err(GeometryError::CalibrationViews {
                actual,
                expected: views.len(),
            });
        }
        let adjustment = Adjustment {
            model,
            views,
            counts: &counts,
            robust_px: 1e3,
        };
        solution = adjustment.solve(solution);
        spread = median_px(&residuals(views, &solution));
    }
    report(views, &counts, model, solution)
}

fn report(
    views: &[PlanarView],
    counts: &[Vec<bool>],
    model: CameraModel,
    solution: Solution,
) -> Result<PlanarCalibration, GeometryError> {
    let kept: Vec<Vec<Option<DVec2>>> = residuals(views, &solution)
        .into_iter()
        .zip(counts)
        .map(|(residuals, counts)| residuals.into_iter().zip(counts).map(|(r, c)| c.then_some(r)).collect())
        .collect();
    let mean_square = |residuals: &mut dyn Iterator<Item = DVec2>| {
        let (sum, count) = residuals.fold((0.0, 0), |(sum, count), r| (sum + r.length_squared(), count + 1));
        (sum / f64::from(count.max(1)), count)
    };
    let (all, count) = mean_square(&mut kept.iter().flatten().flatten().copied());
    let unknowns = model.names().len() + 6 * views.len();
    let freedom = (2 * count as usize).saturating_sub(unknowns).max(1);
    let sigma_px = (all * f64::from(count) / freedom as f64).sqrt();
    let adjustment = Adjustment {
        model,
        views,
        counts,
        robust_px: 1e6,
    };
    let open = GeometryError::CalibrationUndetermined {
        deviation: f64::INFINITY,
    };
    let deviations = adjustment.deviations(&solution, sigma_px).ok_or(open)?;
    let values = model.values(&solution.camera);
    let deviation = deviations[0] / values[0];
    if deviation > FOCAL_DEVIATION {
        return Err(GeometryError::CalibrationUndetermined { deviation });
    }
    let parameters = model.names().iter().zip(values).zip(deviations);
    Ok(PlanarCalibration {
        camera: solution.camera,
        model,
        parameters: parameters
            .map(|((name, value), deviation)| CameraParameter { name, value, deviation })
            .collect(),
        rms_px: all.sqrt(),
        views: kept
            .into_iter()
            .map(|residuals_px| PlanarViewReport {
                rms_px: mean_square(&mut residuals_px.iter().flatten().copied()).0.sqrt(),
                residuals_px,
            })
            .collect(),
    })
}

/// Cameras to start from: Zhang's focal length, and some others.
fn starts(views: &[PlanarView], size: (usize, usize), model: CameraModel) -> Result<Vec<Camera>, GeometryError> {
    let (width, height) = (size.0 as f64, size.1 as f64);
    let (centre, side) = (DVec2::new(width, height) / 2.0, width.max(height));
    let centred = |view: &PlanarView| -> Option<DMat3> {
        let pairs: Vec<_> = view
            .points
            .iter()
            .map(|&(place, pixel)| (place, (pixel - centre) / side))
            .collect();
        homography(&pairs)
    };
    let zhang = focal_length(&views.iter().filter_map(centred).collect::<Vec<_>>());
    let focals = zhang
        .into_iter()
        .filter(|focal| (0.1..10.0).contains(focal))
        .chain(START_FOCALS);
    focals
        .map(|focal| {
            let camera = Camera::pinhole((size.0, size.1), DVec2::splat(focal * side), centre)?;
            match model {
                CameraModel::Fisheye => camera.with_fisheye([0.0; 4]),
                _ => Ok(camera),
            }
        })
        .collect()
}

/// Computed place less seen one, pixels; far off where the target's point has no pixel.
fn residuals(views: &[PlanarView], solution: &Solution) -> Vec<Vec<DVec2>> {
    let of_view = |(view, pose): (&PlanarView, &crate::mesh::RigidMotion)| {
        let residual = |&(place, pixel): &(DVec2, DVec2)| {
            let seen = solution.camera.project(pose.apply(place.extend(0.0)));
            seen.map_or(DVec2::splat(1e6), |seen| seen - pixel)
        };
        view.points.iter().map(residual).collect()
    };
    views.iter().zip(&solution.poses).map(of_view).collect()
}

fn median_px(residuals: &[Vec<DVec2>]) -> f64 {
    let mut lengths: Vec<f64> = residuals.iter().flatten().map(|r| r.length()).collect();
    lengths.sort_unstable_by(f64::total_cmp);
    lengths.get(lengths.len() / 2).copied().unwrap_or_default()
}
