//! The picture of a calibration: where points were seen, and how far they are from where the camera has them.

use crate::output::canvas::Canvas;
use crate::output::lettering::{Align, Lettering};
use deepsft_calibration::{Calibration, Correspondence};
use deepsft_geometry::{ImageSize, Picture};

/// Width of the camera's image in the picture, pixels.
const WIDTH: f64 = 1200.0;

/// Height of the text above and below, pixels.
const BAND: f64 = 44.0;

/// Cells of the coverage along the longer side.
const CELLS: f64 = 16.0;

/// A typical residual is drawn so long, pixels.
const RESIDUAL: f64 = 14.0;

const INK: [u8; 3] = [33, 37, 41];
const EMPTY: [u8; 3] = [255, 236, 230];
const COVERED: [u8; 3] = [226, 243, 234];
const DOT: [u8; 3] = [24, 100, 171];
const WRONG: [u8; 3] = [224, 49, 49];

/// The picture for photographs of `size`.
pub fn chart(size: ImageSize, views: &[Vec<Correspondence>], found: &Calibration) -> Picture {
    let scale = WIDTH / size.width as f64;
    let height = size.height as f64 * scale;
    let mut canvas = Canvas::new(WIDTH as usize, (height + 2.0 * BAND) as usize, [255; 3]);
    let cell = WIDTH.max(height) / CELLS;
    let (columns, rows) = ((WIDTH / cell).ceil() as usize, (height / cell).ceil() as usize);
    let mut covered = vec![false; columns * rows];
    let points = || {
        views
            .iter()
            .zip(&found.views)
            .flat_map(|(seen, view)| seen.iter().map(|point| point.pixel).zip(&view.residuals_px))
    };
    for (pixel, _) in points() {
        let at = (pixel * scale / cell).as_usizevec2();
        covered[at.y.min(rows - 1) * columns + at.x.min(columns - 1)] = true;
    }
    for (index, is_covered) in covered.iter().enumerate() {
        let (left, top) = ((index % columns) as f64 * cell, (index / columns) as f64 * cell);
        let color = if *is_covered { COVERED } else { EMPTY };
        canvas.fill(left, BAND + top, cell.min(WIDTH - left), cell.min(height - top), color);
    }
    let times = RESIDUAL / found.rms_px.max(1e-3);
    for (pixel, residual) in points() {
        let at = (pixel.x * scale, BAND + pixel.y * scale);
        let Some(residual) = residual else {
            canvas.dot(at, 3.5, WRONG);
            continue;
        };
        let end = (at.0 + residual.x * times, at.1 + residual.y * times);
        canvas.line(&[at, end], 1.5, DOT);
        canvas.dot(at, 2.0, DOT);
    }
    let share = 100.0 * covered.iter().filter(|covered| **covered).count() as f64 / covered.len() as f64;
    let above = format!(
        "RMS {:.3} px, {} views; residuals {:.0} times as long as they are, red: left out",
        found.rms_px,
        found.used_views(),
        times / scale
    );
    let below = format!("points in {share:.0} % of the image (green); the lens is only known where there are some");
    for (text, middle) in [(above, BAND / 2.0), (below, 1.5 * BAND + height)] {
        canvas.write(&text, (12.0, middle), Align::Left, Lettering::regular(20.0, INK));
    }
    canvas.into_picture()
}
