//! The training curve as a picture: accuracy on held-out images against samples seen.

use super::canvas::{CHARACTER, Canvas, text_width};
use deepsft_geometry::Picture;
use deepsft_train::CurvePoint;

/// Name of the plot in a bundle.
pub const PLOT_FILE: &str = "curve.png";

const PAPER: [u8; 3] = [252, 251, 247];
const INK: [u8; 3] = [40, 40, 46];
const GRID: [u8; 3] = [222, 220, 212];
const LINE: [u8; 3] = [196, 61, 44];

/// Size of one chart without its margins, pixels.
const WIDTH: usize = 640;
const HEIGHT: usize = 190;
/// Left, right, top and bottom margins of a chart, pixels.
const MARGINS: [usize; 4] = [72, 24, 34, 30];

/// One chart: a title, and (samples, value) in order.
struct Chart {
    title: &'static str,
    points: Vec<(f64, f64)>,
    logarithmic: bool,
}

/// Three charts, one below the other: registration, depth (both on logarithmic scales) and mask IoU.
/// `None` when nothing was measured.
pub fn curve_plot(curve: &[CurvePoint]) -> Option<Picture> {
    let chart = |title, logarithmic, value: fn(&CurvePoint) -> Option<f64>| Chart {
        title,
        points: curve
            .iter()
            .filter_map(|p| Some((p.samples as f64, value(p)?)))
            .collect(),
        logarithmic,
    };
    let charts = [
        chart("registration RMSE, px (median of held-out images)", true, |p| {
            p.registration_rmse_px
        }),
        chart("depth RMSE, mm (median)", true, |p| p.depth_rmse_mm),
        chart("mask IoU (mean)", false, |p| p.mask_iou),
    ];
    let last = curve.last()?.samples as f64;
    let [left, right, top, bottom] = MARGINS;
    let full = top + HEIGHT + bottom;
    let mut canvas = Canvas::new(left + WIDTH + right, charts.len() * full, PAPER);
    for (i, chart) in charts.iter().enumerate() {
        chart.draw(&mut canvas, i * full, last.max(1.0));
    }
    Some(canvas.into_picture())
}

impl Chart {
    fn draw(&self, canvas: &mut Canvas, row: usize, last: f64) {
        let [left, _, top, _] = MARGINS;
        let scale = |value: f64| if self.logarithmic { value.max(1e-9).ln() } else { value };
        canvas.write(self.title, left, row + (top - CHARACTER) / 2, 1, INK);
        let values = || self.points.iter().map(|&(_, value)| value);
        let (least, most) = (
            values().fold(f64::INFINITY, f64::min),
            values().fold(f64::NEG_INFINITY, f64::max),
        );
        if !(least.is_finite() && most.is_finite()) {
            return;
        }
        let ticks = if self.logarithmic {
            decade_ticks(least, most)
        } else {
            linear_ticks(least, most)
        };
        let (low, high) = (scale(ticks[0]), scale(ticks[ticks.len() - 1]));
        let x_of = |samples: f64| left as f64 + samples / last * WIDTH as f64;
        let y_of = |value: f64| (row + top) as f64 + (high - scale(value)) / (high - low) * HEIGHT as f64;
        for &tick in &ticks {
            let y = y_of(tick);
            canvas.line((left as f64, y), (x_of(last), y), GRID);
            let label = label(tick);
            canvas.write(
                &label,
                left - 8 - text_width(&label, 1),
                y as usize - CHARACTER / 2,
                1,
                INK,
            );
        }
        for tick in linear_ticks(0.0, last).into_iter().filter(|&t| t <= last) {
            let x = x_of(tick);
            canvas.line((x, (row + top) as f64), (x, (row + top + HEIGHT) as f64), GRID);
            let label = if tick >= 1000.0 {
                format!("{}k", label(tick / 1000.0))
            } else {
                label(tick)
            };
            canvas.write(
                &label,
                (x as usize).saturating_sub(text_width(&label, 1) / 2),
                row + top + HEIGHT + 6,
                1,
                INK,
            );
        }
        for pair in self.points.windows(2) {
            let place = |(samples, value): (f64, f64)| (x_of(samples), y_of(value));
            canvas.line(place(pair[0]), place(pair[1]), LINE);
        }
        for &(samples, value) in &self.points {
            let (x, y) = (x_of(samples) as usize, y_of(value) as usize);
            for dot in 0..25 {
                canvas.set((x + dot % 5).saturating_sub(2), (y + dot / 5).saturating_sub(2), LINE);
            }
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
        };
        let plot = curve_plot(&[point(0, 40.0), point(1000, 2.0)]).unwrap();
        let row_of = |x: usize| (0..plot.height()).find(|&y| plot.pixel(x, y) == LINE).unwrap();
        let [left, ..] = MARGINS;
        assert!(row_of(left + 10) < row_of(left + WIDTH / 2));
        assert!(row_of(left + WIDTH / 2) < row_of(left + WIDTH - 10));
        assert!(curve_plot(&[]).is_none());
    }
}
