//! The training curve as a picture.

use crate::output::curve_plot::curve_plot;
use deepsft_train::CurvePoint;

#[test]
fn a_falling_error_is_drawn_as_a_falling_line() {
    let point = |samples, px| CurvePoint {
        samples,
        seconds: 0.0,
        loss: 0.0,
        learning_rate: 0.0,
        registration_rmse_px: Some(px),
        depth_rmse_mm: None,
        mask_iou: None,
        photo_consistency_error: None,
    };
    let plot = curve_plot(&[point(0, 40.0), point(1000, 2.0)]).unwrap();
    let row_of = |x: usize| (0..plot.height()).find(|&y| plot.pixel(x, y)[1] < 120).unwrap();
    // Beside the numbers and off the grid's lines, which are light: dark pixels are those of the curve.
    assert!(row_of(74) < row_of(404) && row_of(404) < row_of(734));
    assert!(curve_plot(&[]).is_none());
}
