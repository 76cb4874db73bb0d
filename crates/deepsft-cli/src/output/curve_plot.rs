//! The training curve as a picture: accuracy on held-out images against samples seen.

use super::canvas::Canvas;
use super::lettering::{Align, Lettering};
use deepsft_geometry::Picture;
use deepsft_train::CurvePoint;

/// Name of the plot in a bundle.
pub const PLOT_FILE: &str = "curve.png";

const PAPER: [u8; 3] = [255; 3];
const INK: [u8; 3] = [40, 42, 50];
const FAINT_INK: [u8; 3] = [104, 108, 120];
const CURVE: [u8; 3] = [196, 61, 44];
const GRID: [u8; 3] = [228, 230, 235];

/// Height of an em of titles and of numbers, pixels.
const TITLE_SIZE: f64 = 14.0;
const NUMBER_SIZE: f64 = 12.0;

/// What x is: below the chart.
const X_NAME: &str = "training samples";

/// Size of a chart without its margins, pixels.
const CURVE_SIZE: (usize, usize) = (680, 180);

/// Left, right, top and bottom margins of a chart, pixels.
const MARGINS: [usize; 4] = [64, 24, 40, 50];

/// Least distance of two numbers along the vertical axis, pixels.
const NUMBERS_APART: f64 = 15.0;

/// A chart of one curve. x begins at 0.
struct Chart {
    /// Above the chart.
    title: &'static str,
    /// (x, y) in order, joined by lines.
    points: Vec<(f64, f64)>,
    /// Whether y is drawn on a logarithmic scale.
    logarithmic: bool,
    /// The x at the right end.
    last: f64,
}

impl Chart {
    /// Width and height with the margins, pixels.
    const SIZE: (usize, usize) = {
        let [left, right, top, bottom] = MARGINS;
        (left + CURVE_SIZE.0 + right, top + CURVE_SIZE.1 + bottom)
    };

    /// Draws the chart with the top of its margins at `row`. Without a value there is only the title.
    fn draw(&self, canvas: &mut Canvas, row: usize) {
        let [left, _, top, _] = MARGINS;
        let (left, top) = (left as f64, (row + top) as f64);
        let (width, height) = (CURVE_SIZE.0 as f64, CURVE_SIZE.1 as f64);
        let foot = top + height;
        let scale = |value: f64| if self.logarithmic { value.max(1e-9).ln() } else { value };
        let title = Lettering::semibold(TITLE_SIZE, INK).fitting(self.title, width);
        canvas.write(self.title, (left, top - 20.0), Align::Left, title);
        let least = (self.points.iter()).fold(f64::INFINITY, |least, point| least.min(point.1));
        let most = (self.points.iter()).fold(f64::NEG_INFINITY, |most, point| most.max(point.1));
        if !(least.is_finite() && most.is_finite()) {
            return;
        }
        let ticks = if self.logarithmic {
            decade_ticks(least, most)
        } else {
            linear_ticks(least, most)
        };
        let (low, high) = (scale(ticks[0]), scale(ticks[ticks.len() - 1]));
        let last = self.last.max(f64::MIN_POSITIVE);
        let x_of = |x: f64| left + x / last * width;
        let y_of = |value: f64| top + (high - scale(value)) / (high - low) * height;
        // A line one pixel wide is sharp when it runs along the middle of a row or column.
        let sharp = |at: f64| at.floor() + 0.5;
        let numbers = Lettering::regular(NUMBER_SIZE, FAINT_INK);
        let mut free_below = f64::INFINITY;
        for &tick in &ticks {
            let y = y_of(tick);
            canvas.line(&[(left, sharp(y)), (left + width, sharp(y))], 1.0, GRID);
            if y + NUMBERS_APART <= free_below {
                canvas.write(&label(tick), (left - 9.0, y), Align::Right, numbers);
                free_below = y;
            }
        }
        for tick in linear_ticks(0.0, last).into_iter().filter(|&t| t <= last) {
            let x = sharp(x_of(tick));
            canvas.line(&[(x, top), (x, foot)], 1.0, GRID);
            let label = if tick >= 1000.0 {
                format!("{}k", label(tick / 1000.0))
            } else {
                label(tick)
            };
            canvas.write(&label, (x, foot + 14.0), Align::Centre, numbers);
        }
        canvas.line(&[(left, sharp(foot)), (left + width, sharp(foot))], 1.0, FAINT_INK);
        canvas.write(X_NAME, (left + width / 2.0, foot + 33.0), Align::Centre, numbers);
        let place = |&(x, value): &(f64, f64)| (x_of(x), y_of(value));
        let points: Vec<(f64, f64)> = self.points.iter().map(place).collect();
        canvas.line(&points, 2.0, CURVE);
        for &point in &points {
            canvas.dot(point, 3.0, CURVE);
        }
    }
}

/// 1, 2, 5 times powers of ten that enclose the values.
fn decade_ticks(least: f64, most: f64) -> Vec<f64> {
    let all: Vec<f64> = (-6..7)
        .flat_map(|d| [1.0, 2.0, 5.0].map(|m| m * 10.0_f64.powi(d)))
        .collect();
    let first = all.iter().rposition(|&t| t <= least).unwrap_or(0);
    let last = all
        .iter()
        .position(|&t| t >= most && t > all[first])
        .unwrap_or(all.len() - 1);
    all[first..=last].to_vec()
}

/// About five round values that enclose the values.
fn linear_ticks(least: f64, most: f64) -> Vec<f64> {
    let span = (most - least).max(1e-6);
    let magnitude = 10.0_f64.powf((span / 5.0).log10().floor());
    let step = [1.0, 2.0, 5.0, 10.0]
        .map(|m| m * magnitude)
        .into_iter()
        .find(|s| span / s <= 6.0)
        .unwrap_or(span);
    let first = (least / step).floor() as i64;
    let last = ((most / step).ceil() as i64).max(first + 1);
    (first..=last).map(|i| i as f64 * step).collect()
}

/// A number with as many decimals as it needs, at most four.
fn label(value: f64) -> String {
    let text = format!("{value:.4}");
    text.trim_end_matches('0').trim_end_matches('.').to_owned()
}

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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_enclose_the_values_and_are_round() {
        assert_eq!(decade_ticks(2.3, 40.0), [2.0, 5.0, 10.0, 20.0, 50.0]);
        assert_eq!(decade_ticks(2.0, 2.0), [2.0, 5.0]);
        let ticks = linear_ticks(0.0, 60_000.0);
        assert_eq!(ticks, [0.0, 10_000.0, 20_000.0, 30_000.0, 40_000.0, 50_000.0, 60_000.0]);
        assert_eq!(label(0.95), "0.95");
        assert_eq!(label(10.0), "10");
    }
}
