//! A chart: curves over one axis, with ticks and a grid.

use super::canvas::{CHARACTER, Canvas, text_width};

/// Colour of the ground.
pub const PAPER: [u8; 3] = [252, 251, 247];
/// Colour of axes' numbers and titles.
pub const INK: [u8; 3] = [40, 40, 46];
const GRID: [u8; 3] = [222, 220, 212];

/// Left, right, top and bottom margins of a chart, pixels.
pub const MARGINS: [usize; 4] = [72, 24, 34, 30];

/// Points of one colour, joined by lines: (x, y) in order.
pub struct Curve {
    /// Colour of line and dots.
    pub color: [u8; 3],
    /// (x, y) in order.
    pub points: Vec<(f64, f64)>,
}

/// One chart. x begins at 0.
pub struct Chart {
    /// Above the chart.
    pub title: String,
    /// Drawn in this order.
    pub curves: Vec<Curve>,
    /// Whether y is drawn on a logarithmic scale.
    pub logarithmic: bool,
    /// The x at the right end.
    pub last: f64,
    /// Width and height without the margins, pixels.
    pub size: (usize, usize),
}

impl Chart {
    /// Width and height with the margins, pixels.
    pub fn full_size(&self) -> (usize, usize) {
        let [left, right, top, bottom] = MARGINS;
        (left + self.size.0 + right, top + self.size.1 + bottom)
    }

    /// Draws the chart with the top left corner of its margins at (`column`, `row`). Without a value there is only
    /// the title.
    pub fn draw(&self, canvas: &mut Canvas, column: usize, row: usize) {
        let [left, _, top, _] = MARGINS;
        let (left, top, (width, height)) = (column + left, row + top, self.size);
        let scale = |value: f64| if self.logarithmic { value.max(1e-9).ln() } else { value };
        canvas.write(&self.title, left, row + (MARGINS[2] - CHARACTER) / 2, 1, INK);
        let values = || {
            self.curves
                .iter()
                .flat_map(|curve| &curve.points)
                .map(|&(_, value)| value)
        };
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
        let last = self.last.max(f64::MIN_POSITIVE);
        let x_of = |x: f64| left as f64 + x / last * width as f64;
        let y_of = |value: f64| top as f64 + (high - scale(value)) / (high - low) * height as f64;
        for &tick in &ticks {
            let y = y_of(tick);
            canvas.line((left as f64, y), (x_of(last), y), GRID);
            let label = label(tick);
            canvas.write(
                &label,
                (left - 8).saturating_sub(text_width(&label, 1)),
                y as usize - CHARACTER / 2,
                1,
                INK,
            );
        }
        for tick in linear_ticks(0.0, last).into_iter().filter(|&t| t <= last) {
            let x = x_of(tick);
            canvas.line((x, top as f64), (x, (top + height) as f64), GRID);
            let label = if tick >= 1000.0 {
                format!("{}k", label(tick / 1000.0))
            } else {
                label(tick)
            };
            canvas.write(
                &label,
                (x as usize).saturating_sub(text_width(&label, 1) / 2),
                top + height + 6,
                1,
                INK,
            );
        }
        for curve in &self.curves {
            for pair in curve.points.windows(2) {
                let place = |(x, value): (f64, f64)| (x_of(x), y_of(value));
                canvas.line(place(pair[0]), place(pair[1]), curve.color);
            }
            for &(x, value) in &curve.points {
                let (x, y) = (x_of(x) as usize, y_of(value) as usize);
                for dot in 0..25 {
                    canvas.set(
                        (x + dot % 5).saturating_sub(2),
                        (y + dot / 5).saturating_sub(2),
                        curve.color,
                    );
                }
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
}
