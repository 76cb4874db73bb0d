//! From points of a flat target in several views to the camera.

use super::adjustment::{Adjustment, Solution};
use super::camera_model::{CameraModel, CameraParameter};
use super::homography::{focal_length, homography, pose};
use crate::camera::Camera;
use crate::error::GeometryError;
use crate::image::ImageSize;
use crate::mesh::RigidMotion;
use glam::{DMat3, DVec2};

/// Fewest points of a view that is used.
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
    /// Root mean square of the distances between seen and computed places, pixels; `None` for a view that was left out.
    pub rms_px: Option<f64>,
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

impl PlanarCalibration {
    /// Counts the views that were used.
    pub fn used_views(&self) -> usize {
        self.views.iter().filter(|view| view.rms_px.is_some()).count()
    }
}

/// The camera of `size` that saw `views` of a flat target: a start from Zhang's equations, then the least distances in
/// the image over camera and poses. Wrong points are left out, and views with fewer than 6 right ones. Without a `model` the one with the fewest parameters that
/// explains the views (Bayesian information criterion): they may not hold more. [`CameraModel::Fisheye`] is never chosen.
///
/// # Errors
/// * [`GeometryError::CalibrationViews`] for fewer than 3 views with at least 6 right points each; for [`CameraModel::Focal`] 1.
/// * [`GeometryError::CalibrationUndetermined`] when the views leave the focal length open, for they are all parallel, or do not fit.
/// * [`GeometryError::CameraParameter`] for an empty image.
pub fn calibrate(
    views: &[PlanarView],
    size: ImageSize,
    model: Option<CameraModel>,
) -> Result<PlanarCalibration, GeometryError> {
    let expected = if model == Some(CameraModel::Focal) { 1 } else { 3 };
    if let Some(model) = model {
        return calibrated(views, size, model, expected);
    }
    let mut best: Option<(f64, PlanarCalibration)> = None;
    let mut last = None;
    for model in [
        CameraModel::Focal,
        CameraModel::Pinhole,
        CameraModel::Radial,
        CameraModel::Polynomial,
    ] {
        match calibrated(views, size, model, expected) {
            Ok(found) => {
                let criterion = criterion(&found);
                // No model wins by leaving out a view.
                let is_better = |(least, best): &(f64, PlanarCalibration)| {
                    let (used, before) = (found.used_views(), best.used_views());
                    used > before || used == before && criterion < *least
                };
                if best.as_ref().is_none_or(is_better) {
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

/// The Bayesian information criterion of the views used. Points left out count as if they were as wrong as those that are just kept: no model wins by
/// leaving out more.
fn criterion(found: &PlanarCalibration) -> f64 {
    let used = || found.views.iter().filter(|view| view.rms_px.is_some());
    let residuals = || used().flat_map(|view| &view.residuals_px);
    let kept: f64 = residuals().flatten().map(|r| r.length_squared()).sum();
    let left_out = residuals().filter(|r| r.is_none()).count() as f64;
    let limit = NEVER_WRONG_PX.max(WRONG_DEVIATIONS * found.rms_px);
    let count = 2.0 * residuals().count() as f64;
    let unknowns = (found.parameters.len() + 6 * used().count()) as f64;
    count * ((kept + left_out * limit * limit) / count).ln() + unknowns * count.ln()
}

/// The calibration for one model. `expected`: fewest views.
fn calibrated(
    views: &[PlanarView],
    size: ImageSize,
    model: CameraModel,
    expected: usize,
) -> Result<PlanarCalibration, GeometryError> {
    let has_enough = |&view: &usize| views[view].points.len() >= MIN_POINTS;
    let usable: Vec<usize> = (0..views.len()).filter(has_enough).collect();
    let mut counts: Vec<Vec<bool>> = views.iter().map(|view| vec![true; view.points.len()]).collect();
    // The views that are used, and what is found of them, in the same order.
    let mut best: Option<(f64, Vec<usize>, Solution)> = None;
    let mut actual = usable.len();
    for camera in starts(views, &usable, size, model)? {
        let posed = |&view: &usize| Some((view, pose(&camera, &views[view].points)?));
        let (used, poses): (Vec<usize>, Vec<RigidMotion>) = usable.iter().filter_map(posed).unzip();
        if used.len() < expected {
            actual = actual.min(used.len());
            continue;
        }
        let found = adjustment(views, &used, &counts, model, 2.0).solve(Solution { camera, poses });
        let spread = median_px(&residuals(views, &used, &found), &usable);
        if best.as_ref().is_none_or(|(least, ..)| spread < *least) {
            best = Some((spread, used, found));
        }
    }
    let (_, mut used, mut solution) = best.ok_or(GeometryError::CalibrationViews { actual, expected })?;
    for _ in 0..3 {
        let all = residuals(views, &used, &solution);
        // The median distance of points with a deviation of 1 in both coordinates is 1.18.
        let limit = (WRONG_DEVIATIONS * median_px(&all, &used) / 1.18).max(NEVER_WRONG_PX);
        for (counts, residuals) in counts.iter_mut().zip(all) {
            *counts = residuals.iter().map(|r| r.length() < limit).collect();
        }
        let is_right = |view: usize| counts[view].iter().filter(|counts| **counts).count() >= MIN_POINTS;
        let right = used.iter().zip(solution.poses).filter(|(view, _)| is_right(**view));
        let (kept, poses): (Vec<usize>, Vec<RigidMotion>) = right.unzip();
        if kept.len() < expected {
            let actual = kept.len();
            return Err(GeometryError::CalibrationViews { actual, expected });
        }
        used = kept;
        let camera = solution.camera;
        solution = adjustment(views, &used, &counts, model, 1e3).solve(Solution { camera, poses });
    }
    report(views, &used, &counts, model, solution)
}

/// The adjustment of the points that count in the views used.
fn adjustment(
    views: &[PlanarView],
    used: &[usize],
    counts: &[Vec<bool>],
    model: CameraModel,
    robust_px: f64,
) -> Adjustment {
    let of_view = |(number, &view): (usize, &usize)| {
        let counted = views[view]
            .points
            .iter()
            .zip(&counts[view])
            .filter(|(_, counts)| **counts);
        counted.map(move |(&(place, pixel), _)| (number, place, pixel))
    };
    Adjustment {
        model,
        points: used.iter().enumerate().flat_map(of_view).collect(),
        robust_px,
    }
}

fn report(
    views: &[PlanarView],
    used: &[usize],
    counts: &[Vec<bool>],
    model: CameraModel,
    solution: Solution,
) -> Result<PlanarCalibration, GeometryError> {
    let kept: Vec<Vec<Option<DVec2>>> = (residuals(views, used, &solution).into_iter().zip(counts).enumerate())
        .map(|(view, (residuals, counts))| {
            let is_used = used.contains(&view);
            let points = residuals.into_iter().zip(counts);
            points.map(|(r, counts)| (is_used && *counts).then_some(r)).collect()
        })
        .collect();
    let mean_square = |residuals: &mut dyn Iterator<Item = DVec2>| {
        let (sum, count) = residuals.fold((0.0, 0), |(sum, count), r| (sum + r.length_squared(), count + 1));
        (sum / f64::from(count.max(1)), count)
    };
    let (all, count) = mean_square(&mut kept.iter().flatten().flatten().copied());
    let unknowns = model.names().len() + 6 * used.len();
    let freedom = (2 * count as usize).saturating_sub(unknowns).max(1);
    let sigma_px = (all * f64::from(count) / freedom as f64).sqrt();
    let open = GeometryError::CalibrationUndetermined {
        deviation: f64::INFINITY,
    };
    let deviations = adjustment(views, used, counts, model, 1e6)
        .deviations(&solution, sigma_px)
        .ok_or(open)?;
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
            .enumerate()
            .map(|(view, residuals_px)| PlanarViewReport {
                rms_px: (used.contains(&view))
                    .then(|| mean_square(&mut residuals_px.iter().flatten().copied()).0.sqrt()),
                residuals_px,
            })
            .collect(),
    })
}

/// Cameras to start from: Zhang's focal length, and some others.
fn starts(
    views: &[PlanarView],
    usable: &[usize],
    size: ImageSize,
    model: CameraModel,
) -> Result<Vec<Camera>, GeometryError> {
    let (width, height) = size.as_dvec2().into();
    let (centre, side) = (DVec2::new(width, height) / 2.0, width.max(height));
    let centred = |&view: &usize| -> Option<DMat3> {
        let pairs: Vec<_> = views[view]
            .points
            .iter()
            .map(|&(place, pixel)| (place, (pixel - centre) / side))
            .collect();
        homography(&pairs)
    };
    let zhang = focal_length(&usable.iter().filter_map(centred).collect::<Vec<_>>());
    let focals = zhang
        .into_iter()
        .filter(|focal| (0.1..10.0).contains(focal))
        .chain(START_FOCALS);
    focals
        .map(|focal| {
            let camera = Camera::pinhole(size, DVec2::splat(focal * side), centre)?;
            match model {
                CameraModel::Fisheye => camera.with_fisheye([0.0; 4]),
                _ => Ok(camera),
            }
        })
        .collect()
}

/// Computed place less seen one, pixels; far off where the target's point has no pixel and in views that are not used.
fn residuals(views: &[PlanarView], used: &[usize], solution: &Solution) -> Vec<Vec<DVec2>> {
    let of_view = |(number, view): (usize, &PlanarView)| {
        let pose = used
            .iter()
            .position(|&used| used == number)
            .map(|at| &solution.poses[at]);
        let residual = |&(place, pixel): &(DVec2, DVec2)| {
            let seen = pose.and_then(|pose| solution.camera.project(pose.apply(place.extend(0.0))));
            seen.map_or(DVec2::splat(1e6), |seen| seen - pixel)
        };
        view.points.iter().map(residual).collect()
    };
    views.iter().enumerate().map(of_view).collect()
}

/// The median distance in some of the views.
fn median_px(residuals: &[Vec<DVec2>], views: &[usize]) -> f64 {
    let mut lengths: Vec<f64> = (views.iter().flat_map(|&view| &residuals[view]))
        .map(|r| r.length())
        .collect();
    lengths.sort_unstable_by(f64::total_cmp);
    lengths.get(lengths.len() / 2).copied().unwrap_or_default()
}
