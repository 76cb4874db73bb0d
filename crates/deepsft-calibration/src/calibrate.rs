//! From points of a flat target in several views to the camera.

use crate::adjustment::{Adjustment, Solution};
use crate::camera_model::{CameraModel, CameraParameter};
use crate::correspondence::Correspondence;
use crate::error::{CalibrationError, Result};
use crate::homography::{focal_length, homography, pose};
use deepsft_geometry::glam::DVec2;
use deepsft_geometry::solver::Robust;
use deepsft_geometry::{Camera, GeometryError, ImageSize};

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

/// The same where the focal length alone is asked for, or nothing else is held: a guess is farther off.
const LONE_FOCAL_DEVIATION: f64 = 0.2;

/// Standard deviations of what a camera is not calibrated for, where its focal length alone is asked for: the principal point from the image's
/// centre, of its longer side, and the ratio of the focal lengths along its sides from 1.
const OFF_CENTRE: f64 = 0.01;
const UNEVEN: f64 = 0.003;

/// The residuals of one view.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct CalibratedView {
    /// Root mean square of the distances between seen and computed places, pixels; `None` for a view that was left out.
    pub rms_px: Option<f64>,
    /// Computed place less seen one, pixels, for each point; `None` for points that were left out as wrong.
    pub residuals_px: Vec<Option<DVec2>>,
}

/// A calibrated camera, with deviations and residuals.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Calibration {
    /// The camera.
    pub camera: Camera,
    /// What was solved for.
    pub model: CameraModel,
    /// What was found, with deviations.
    pub parameters: Vec<CameraParameter>,
    /// Root mean square of the distances between seen and computed places, pixels.
    pub rms_px: f64,
    /// The views, as given.
    pub views: Vec<CalibratedView>,
}

impl Calibration {
    /// Counts the views that were used.
    pub fn used_views(&self) -> usize {
        self.views.iter().filter(|view| view.rms_px.is_some()).count()
    }

    /// The Bayesian information criterion of the views used. Points left out count as if they were as wrong as those that are just kept:
    /// no model wins by leaving out more.
    fn criterion(&self) -> f64 {
        let used = || self.views.iter().filter(|view| view.rms_px.is_some());
        let residuals = || used().flat_map(|view| &view.residuals_px);
        let kept: f64 = residuals().flatten().map(|r| r.length_squared()).sum();
        let left_out = residuals().filter(|r| r.is_none()).count() as f64;
        let limit = NEVER_WRONG_PX.max(WRONG_DEVIATIONS * self.rms_px);
        let count = 2.0 * residuals().count() as f64;
        let unknowns = (self.parameters.len() + 6 * used().count()) as f64;
        count * ((kept + left_out * limit * limit) / count).ln() + unknowns * count.ln()
    }
}

/// Calibrates the camera of `size` that saw `views` of a flat target.
///
/// It starts from Zhang's equations and minimises the distances in the image over camera and poses. Wrong points are left out, and views with
/// fewer than 6 right ones. Without a `model` it takes the one with the fewest parameters that explains the views (Bayesian information
/// criterion), for they may not hold more. It never chooses [`CameraModel::Fisheye`]. Of one or two views, and of those that hold little,
/// it gives the focal length alone, up to a standard deviation of 20 %. A principal point off the centre and pixels that are not square are in it.
///
/// # Errors
/// * [`CalibrationError::Views`] for no view with at least 6 right points; for a `model` other than [`CameraModel::Focal`] fewer than 3.
/// * [`CalibrationError::Undetermined`] when the views leave the focal length open, for they are all parallel, or do not fit.
/// * [`CalibrationError::Camera`] for an empty image.
pub fn calibrate(views: &[Vec<Correspondence>], size: ImageSize, model: Option<CameraModel>) -> Result<Calibration> {
    if let Some(model) = model {
        let (expected, most) = match model {
            CameraModel::Focal => (1, LONE_FOCAL_DEVIATION),
            _ => (3, FOCAL_DEVIATION),
        };
        return calibrated(views, size, model, expected, most);
    }
    let mut best = calibrated(views, size, CameraModel::Focal, 3, FOCAL_DEVIATION);
    for model in [CameraModel::Pinhole, CameraModel::Radial, CameraModel::Polynomial] {
        let found = calibrated(views, size, model, 3, FOCAL_DEVIATION);
        let is_better = match (&found, &best) {
            (Ok(found), Ok(best)) => {
                // No model wins by leaving out a view.
                let (used, before) = (found.used_views(), best.used_views());
                used > before || used == before && found.criterion() < best.criterion()
            }
            (_, best) => best.is_err(),
        };
        if is_better {
            best = found;
        }
    }
    best.or_else(|error| calibrated(views, size, CameraModel::Focal, 1, LONE_FOCAL_DEVIATION).or(Err(error)))
}

/// The calibration for one model. `expected`: fewest views; `most`: greatest deviation of the focal length, a fraction of it.
fn calibrated(
    views: &[Vec<Correspondence>],
    size: ImageSize,
    model: CameraModel,
    expected: usize,
    most: f64,
) -> Result<Calibration> {
    let usable: Vec<usize> = (0..views.len()).filter(|&v| views[v].len() >= MIN_POINTS).collect();
    let mut counts: Vec<Vec<bool>> = views.iter().map(|view| vec![true; view.len()]).collect();
    let mut best: Option<(f64, Solution)> = None;
    let mut actual = usable.len();
    for camera in starts(views, &usable, size, model)? {
        let posed = |&view: &usize| Some((view, pose(&camera, &views[view])?));
        let poses: Vec<_> = usable.iter().filter_map(posed).collect();
        if poses.len() < expected {
            actual = actual.min(poses.len());
            continue;
        }
        let start = Solution { camera, poses };
        let found = adjustment(views, &counts, model, 2.0, &start).solve(start);
        let spread = median_px(&residuals(views, &found), usable.iter().copied());
        if best.as_ref().is_none_or(|(least, _)| spread < *least) {
            best = Some((spread, found));
        }
    }
    let (_, mut solution) = best.ok_or(CalibrationError::Views { actual, expected })?;
    for _ in 0..3 {
        let all = residuals(views, &solution);
        // The median distance of points with a deviation of 1 in both coordinates is 1.18.
        let median = median_px(&all, solution.poses.iter().map(|(view, _)| *view));
        let limit = (WRONG_DEVIATIONS * median / 1.18).max(NEVER_WRONG_PX);
        for (counts, residuals) in counts.iter_mut().zip(all) {
            *counts = residuals.iter().map(|r| r.length() < limit).collect();
        }
        let right = |view: usize| counts[view].iter().filter(|counts| **counts).count();
        solution.poses.retain(|(view, _)| right(*view) >= MIN_POINTS);
        let actual = solution.poses.len();
        if actual < expected {
            return Err(CalibrationError::Views { actual, expected });
        }
        solution = adjustment(views, &counts, model, 1e3, &solution).solve(solution);
    }
    report(views, &counts, model, solution, most)
}

/// The adjustment of the points that count in the views that `solution` uses.
fn adjustment(
    views: &[Vec<Correspondence>],
    counts: &[Vec<bool>],
    model: CameraModel,
    robust_px: f64,
    solution: &Solution,
) -> Adjustment {
    let of_view = |(index, &(view, _)): (usize, &(usize, _))| {
        let counted = views[view].iter().zip(&counts[view]).filter(|(_, counts)| **counts);
        counted.map(move |(point, _)| (index, *point))
    };
    Adjustment {
        model,
        points: solution.poses.iter().enumerate().flat_map(of_view).collect(),
        robust: Robust::Cauchy(robust_px),
    }
}

fn report(
    views: &[Vec<Correspondence>],
    counts: &[Vec<bool>],
    model: CameraModel,
    solution: Solution,
    most: f64,
) -> Result<Calibration> {
    let is_used = |view: usize| solution.poses.iter().any(|(used, _)| *used == view);
    let kept = |(view, (residuals, counts)): (usize, (Vec<DVec2>, &Vec<bool>))| {
        let points = residuals.into_iter().zip(counts);
        (points.map(|(r, counts)| (is_used(view) && *counts).then_some(r))).collect()
    };
    let all = residuals(views, &solution).into_iter().zip(counts).enumerate();
    let kept: Vec<Vec<Option<DVec2>>> = all.map(kept).collect();
    let mean_square = |residuals: &mut dyn Iterator<Item = &DVec2>| {
        let (sum, count) = residuals.fold((0.0, 0), |(sum, count), r| (sum + r.length_squared(), count + 1));
        (sum / f64::from(count.max(1)), count)
    };
    let (all, count) = mean_square(&mut kept.iter().flatten().flatten());
    let unknowns = model.names().len() + 6 * solution.poses.len();
    let freedom = (2 * count as usize).saturating_sub(unknowns).max(1);
    let sigma_px = (all * f64::from(count) / freedom as f64).sqrt();
    let adjustment = adjustment(views, counts, model, 1e6, &solution);
    let deviations = adjustment.deviations(&solution, sigma_px);
    let mut deviations = deviations.ok_or(CalibrationError::Undetermined(f64::INFINITY))?;
    if model == CameraModel::Focal {
        let (focal, size) = (solution.camera.focal().x, solution.camera.size().as_dvec2());
        let off = OFF_CENTRE * size.max_element();
        let ways: [&dyn Fn(DVec2) -> DVec2; 3] = [&|_| DVec2::new(off, 0.0), &|_| DVec2::new(0.0, off), &|pixel| {
            DVec2::new(0.0, UNEVEN * (pixel.y - size.y / 2.0))
        }];
        for way in ways {
            // Another focal length is as good for a camera that is so much off.
            let mut moved = adjustment.clone();
            for (_, point) in &mut moved.points {
                point.pixel += way(point.pixel);
            }
            deviations[0] = deviations[0].hypot(moved.solve(solution.clone()).camera.focal().x - focal);
        }
    }
    let values = model.values(&solution.camera);
    let deviation = deviations[0] / values[0];
    if deviation > most {
        return Err(CalibrationError::Undetermined(deviation));
    }
    let parameters = model.names().iter().zip(values).zip(deviations);
    let reported = |(view, residuals_px): (usize, Vec<Option<DVec2>>)| CalibratedView {
        rms_px: is_used(view).then(|| mean_square(&mut residuals_px.iter().flatten()).0.sqrt()),
        residuals_px,
    };
    Ok(Calibration {
        camera: solution.camera,
        model,
        parameters: parameters
            .map(|((name, value), standard_deviation)| CameraParameter {
                name,
                value,
                standard_deviation,
            })
            .collect(),
        rms_px: all.sqrt(),
        views: kept.into_iter().enumerate().map(reported).collect(),
    })
}

/// Cameras to start from: Zhang's focal length, and some others.
fn starts(
    views: &[Vec<Correspondence>],
    usable: &[usize],
    size: ImageSize,
    model: CameraModel,
) -> Result<Vec<Camera>, GeometryError> {
    let (centre, side) = (size.as_dvec2() / 2.0, size.as_dvec2().max_element());
    let centred = |&view: &usize| {
        let centred = |p: &Correspondence| (p.place_mm, (p.pixel - centre) / side);
        homography(&views[view].iter().map(centred).collect::<Vec<_>>())
    };
    let zhang = focal_length(&usable.iter().filter_map(centred).collect::<Vec<_>>());
    let zhang = zhang.into_iter().filter(|focal| (0.1..10.0).contains(focal));
    (zhang.chain(START_FOCALS))
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
fn residuals(views: &[Vec<Correspondence>], solution: &Solution) -> Vec<Vec<DVec2>> {
    let of_view = |(view, points): (usize, &Vec<Correspondence>)| {
        let pose = solution.poses.iter().find(|(used, _)| *used == view);
        let residual = |point| solution.residual(&pose?.1, point);
        let or_far_off = |point| residual(point).unwrap_or(DVec2::splat(1e6));
        points.iter().map(or_far_off).collect()
    };
    views.iter().enumerate().map(of_view).collect()
}

fn median_px(residuals: &[Vec<DVec2>], views: impl Iterator<Item = usize>) -> f64 {
    let mut lengths: Vec<f64> = views.flat_map(|view| &residuals[view]).map(|r| r.length()).collect();
    lengths.sort_unstable_by(f64::total_cmp);
    lengths.get(lengths.len() / 2).copied().unwrap_or_default()
}
