//! The training curve as a picture: accuracy on held-out images against samples seen.

use super::canvas::Canvas;
use super::chart::{Chart, PAPER};
use deepsft_geometry::Picture;
use deepsft_train::CurvePoint;

/// Name of the plot in a bundle.
pub const PLOT_FILE: &str = "curve.png";

/// Charts, one below the other: registration, depth (both on logarithmic scales), mask IoU, E_pr, and the training's loss;
/// those without a value are left out. `None` when nothing was measured.
pub fn curve_plot(curve: &[CurvePoint]) -> Option<Picture> {
    let last = curve.last()?.samples as f64;
    let chart = |title, logarithmic, value: fn(&CurvePoint) -> Option<f64>| Chart {
        title,
        points: (curve.iter())
            .filter_map(|p| Some((p.samples as f64, value(p)?)))
            .collect(),
        logarithmic,
        last: last.max(1.0),
    };
    let charts = [
        chart("registration RMSE, px (median of held-out images)", true, |p| {
            p.registration_rmse_px
        }),
        chart("depth RMSE, mm (median)", true, |p| p.depth_rmse_mm),
        chart("mask IoU (mean)", false, |p| p.mask_iou),
        chart("E_pr, photometric error (median)", false, |p| p.photo_consistency_error),
        chart("training loss (mean since the last point)", true, |p| {
            Some(p.loss).filter(|&loss| loss > 0.0)
        }),
    ];
    let charts = charts.into_iter().filter(|chart| !chart.points.is_empty());
    let charts: Vec<Chart> = charts.collect();
    if charts.is_empty() {
        return None;
    }
    let (width, height) = Chart::SIZE;
    let mut canvas = Canvas::new(width, charts.len() * height, PAPER);
    for (i, chart) in charts.iter().enumerate() {
        chart.draw(&mut canvas, i * height);
    }
    Some(canvas.into_picture())
}
