//! What a study says of one frame, and of all frames of a level.

use super::plan::Start;
use deepsft_geometry::Maps;
use deepsft_geometry::glam::DVec3;
use deepsft_geometry::metrics::{FrameMetrics, Summary};
use serde::Serialize;

/// The errors of one answer to one frame, or their mean or median over frames.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Errors {
    /// RMSE of the 3D points, mm.
    pub rmse_3d_mm: Option<f64>,
    /// RMSE of the depth, mm.
    pub depth_rmse_mm: Option<f64>,
    /// RMSE of the registration, pixels of the 480 x 270 image.
    pub registration_rmse_px: Option<f64>,
    /// Depth over true depth, median of the frame's pixels.
    pub depth_ratio: Option<f64>,
    /// RMSE of the depth after division by that ratio, mm: how wrong the shape is, its distance apart.
    pub rescaled_depth_rmse_mm: Option<f64>,
}

/// What became of one frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Outcome {
    /// Whether the estimator found the object. Only then there is anything to fit.
    pub found: bool,
    /// Errors of the maps that the fit starts from.
    pub start: Errors,
    /// Errors of the result: the fitted mesh's maps, or the start's where the fit was rejected.
    pub fitted: Errors,
    /// Whether the mesh was taken. `None` when the maps show too little to fit one.
    pub accepted: Option<bool>,
    /// RMSE of all vertices of a mesh that was taken, hidden ones too, mm.
    pub mesh_rmse_mm: Option<f64>,
}

/// One level of one series.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Level {
    /// The level, in the series' unit.
    pub level: f64,
    /// Frames that show the object.
    pub frames: usize,
    /// Frames in which the estimator found it: all figures below are over these.
    pub found: usize,
    /// Frames that show too little to fit a mesh.
    pub not_fitted: usize,
    /// Fraction of the fits that were rejected in favour of the maps they started from.
    pub fallback_fraction: Option<f64>,
    /// Fraction of the frames in which the fit has the larger registration error.
    pub worse_registration_fraction: Option<f64>,
    /// Fraction of the frames in which the fit has the larger 3D error.
    pub worse_3d_fraction: Option<f64>,
    /// The maps that the fit starts from.
    pub start: ErrorSummary,
    /// The result: the fitted mesh's maps, or the start's where the fit was rejected.
    pub fitted: ErrorSummary,
    /// RMSE of all vertices of the meshes that were taken, hidden ones too, mm: median.
    pub mesh_rmse_mm: Option<f64>,
}

/// Mean and median over frames.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct ErrorSummary {
    /// Means.
    pub mean: Errors,
    /// Medians.
    pub median: Errors,
}

/// One thing varied.
#[derive(Clone, Debug, Serialize)]
pub struct Series {
    /// What is varied.
    pub name: &'static str,
    /// Unit of the levels.
    pub unit: &'static str,
    /// Where the fit starts.
    pub start: Start,
    /// The levels.
    pub rows: Vec<Level>,
}

impl Errors {
    pub fn new(metrics: &FrameMetrics, predicted: &Maps, truth: &Maps) -> Self {
        let both: Vec<(f64, f64)> = (0..truth.depth().len())
            .filter(|&pixel| predicted.inside(pixel) && truth.inside(pixel))
            .map(|pixel| (f64::from(predicted.depth()[pixel]), f64::from(truth.depth()[pixel])))
            .collect();
        let ratio = Summary::of(both.iter().map(|(depth, truth)| Some(depth / truth))).map(|s| s.median);
        let rescaled = ratio.map(|ratio| {
            let squares = both.iter().map(|(depth, truth)| (depth / ratio - truth).powi(2));
            (squares.sum::<f64>() / both.len() as f64).sqrt()
        });
        Self {
            rmse_3d_mm: metrics.points_rmse_mm,
            depth_rmse_mm: metrics.depth_rmse_mm,
            registration_rmse_px: metrics.registration_rmse_px,
            depth_ratio: ratio,
            rescaled_depth_rmse_mm: rescaled,
        }
    }
}

impl ErrorSummary {
    fn of<'a>(frames: impl Iterator<Item = &'a Errors> + Clone) -> Self {
        let figures = |pick: fn(Summary) -> f64| {
            let of = |error: fn(&Errors) -> Option<f64>| Summary::of(frames.clone().map(error)).map(pick);
            Errors {
                rmse_3d_mm: of(|e| e.rmse_3d_mm),
                depth_rmse_mm: of(|e| e.depth_rmse_mm),
                registration_rmse_px: of(|e| e.registration_rmse_px),
                depth_ratio: of(|e| e.depth_ratio),
                rescaled_depth_rmse_mm: of(|e| e.rescaled_depth_rmse_mm),
            }
        };
        Self {
            mean: figures(|s| s.mean),
            median: figures(|s| s.median),
        }
    }
}

impl Level {
    pub fn new(level: f64, outcomes: &[Outcome]) -> Self {
        let found: Vec<&Outcome> = outcomes.iter().filter(|o| o.found).collect();
        let fraction = |of: usize, among: usize| (among > 0).then(|| of as f64 / among as f64);
        let fits = found.iter().filter(|o| o.accepted.is_some()).count();
        let fallbacks = found.iter().filter(|o| o.accepted == Some(false)).count();
        let worse = |error: fn(&Errors) -> Option<f64>| {
            let both = found.iter().filter_map(|o| Some((error(&o.start)?, error(&o.fitted)?)));
            let worse = both.clone().filter(|(start, fitted)| fitted > start).count();
            fraction(worse, both.count())
        };
        Self {
            level,
            frames: outcomes.len(),
            found: found.len(),
            not_fitted: found.len() - fits,
            fallback_fraction: fraction(fallbacks, fits),
            worse_registration_fraction: worse(|e| e.registration_rmse_px),
            worse_3d_fraction: worse(|e| e.rmse_3d_mm),
            start: ErrorSummary::of(found.iter().map(|o| &o.start)),
            fitted: ErrorSummary::of(found.iter().map(|o| &o.fitted)),
            mesh_rmse_mm: Summary::of(found.iter().map(|o| o.mesh_rmse_mm)).map(|s| s.median),
        }
    }
}

/// Root mean square distance of a mesh's vertices from the true ones, mm. The true mesh may have the cells of
/// the `grid` (columns, rows) of vertices cut into four. `None` for other numbers of vertices.
pub fn mesh_rmse(vertices: &[DVec3], truth: &[DVec3], (columns, rows): (usize, usize)) -> Option<f64> {
    let (fine_columns, fine_rows) = (2 * columns - 1, 2 * rows - 1);
    let of = |vertex: usize| match truth.len() {
        same if same == columns * rows => Some(vertex),
        finer if finer == fine_columns * fine_rows => {
            Some(2 * (vertex / columns) * fine_columns + 2 * (vertex % columns))
        }
        _ => None,
    };
    let squares = (vertices.iter().enumerate()).map(|(vertex, p)| Some(p.distance_squared(truth[of(vertex)?])));
    let sum = squares.sum::<Option<f64>>()?;
    (!vertices.is_empty()).then(|| (sum / vertices.len() as f64).sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn errors(px: f64) -> Errors {
        Errors {
            registration_rmse_px: Some(px),
            rmse_3d_mm: Some(10.0 * px),
            ..Errors::default()
        }
    }

    fn outcome(found: bool, accepted: Option<bool>, start: f64, fitted: f64) -> Outcome {
        Outcome {
            found,
            start: errors(start),
            fitted: errors(fitted),
            accepted,
            mesh_rmse_mm: None,
        }
    }

    #[test]
    fn a_row_counts_what_was_not_found_not_fitted_and_not_taken() {
        let row = Level::new(
            8.0,
            &[
                outcome(true, Some(true), 4.0, 1.0),
                outcome(true, Some(true), 2.0, 3.0),
                outcome(true, Some(false), 6.0, 6.0),
                outcome(true, None, 9.0, 9.0),
                outcome(false, None, 99.0, 99.0),
            ],
        );
        assert_eq!((row.frames, row.found, row.not_fitted), (5, 4, 1));
        assert_eq!(row.fallback_fraction, Some(1.0 / 3.0));
        assert_eq!(row.worse_registration_fraction, Some(0.25));
        assert_eq!(row.start.mean.registration_rmse_px, Some(5.25));
        assert_eq!(row.fitted.median.registration_rmse_px, Some(4.5));
        assert_eq!(row.fitted.median.rmse_3d_mm, Some(45.0));
        assert_eq!(row.fitted.median.depth_rmse_mm, None);
    }

    #[test]
    fn a_depth_that_is_a_tenth_too_large_everywhere_has_the_right_shape() {
        let mut truth = Maps::empty(20, 10);
        (0..200).for_each(|pixel| truth.set(pixel, 400.0 + pixel as f32, [0.5; 2]));
        let mut predicted = truth.clone();
        (0..200).for_each(|pixel| predicted.set(pixel, 1.1 * truth.depth()[pixel], [0.5; 2]));
        let errors = Errors::new(&FrameMetrics::default(), &predicted, &truth);
        // f32 depths near 600 are good to 3e-5.
        assert!((errors.depth_ratio.unwrap() - 1.1).abs() < 1e-6);
        assert!(errors.rescaled_depth_rmse_mm.unwrap() < 1e-4);
    }

    #[test]
    fn vertices_are_compared_with_the_same_places_of_a_finer_mesh() {
        let at = |i: usize, j: usize| DVec3::new(i as f64, j as f64, 7.0);
        let grid = |columns: usize, rows: usize, step: f64| -> Vec<DVec3> {
            (0..columns * rows)
                .map(|k| at(k % columns, k / columns) * DVec3::new(step, step, 1.0))
                .collect()
        };
        let coarse = grid(4, 3, 1.0);
        assert_eq!(mesh_rmse(&coarse, &grid(7, 5, 0.5), (4, 3)), Some(0.0));
        let moved: Vec<DVec3> = coarse.iter().map(|p| *p + DVec3::Z * 2.0).collect();
        assert_eq!(mesh_rmse(&moved, &coarse, (4, 3)), Some(2.0));
        assert_eq!(mesh_rmse(&coarse, &grid(6, 5, 0.5), (4, 3)), None);
    }
}
