//! The curves of a study: errors before and after the fit against what makes a frame hard.

use super::outcome::{Errors, Series};
use deepsft_cli::output::canvas::Canvas;
use deepsft_cli::output::chart::{Chart, Curve, INK, NUMBER_SIZE, PAPER, TITLE_SIZE};
use deepsft_cli::output::lettering::{Align, Lettering};
use deepsft_geometry::Picture;

const START: [u8; 3] = [138, 144, 162];
const FITTED: [u8; 3] = [204, 62, 44];

/// Size of one chart without its margins, pixels.
const SIZE: (usize, usize) = (300, 130);

/// Height of the legend above the charts, and of a series' name above its charts, pixels.
const LEGEND: usize = 40;
const HEADING: usize = 22;

/// Length of a line in a legend, and the gap beside it, pixels.
const LEGEND_LINE: f64 = 22.0;
const LEGEND_GAP: f64 = 7.0;

/// Left end of headings and the legend, pixels.
const LEFT: f64 = 16.0;

/// Three charts per series in a row (3D, depth, registration; medians, logarithmic): the maps that the fit starts from
/// in grey and the fit in red. Series of fewer than three levels are no curve and are left out. `None` when none is
/// left.
pub fn study_plot(series: &[Series]) -> Option<Picture> {
    type Value = fn(&Errors) -> Option<f64>;
    let metrics: [(&str, Value); 3] = [
        ("3D, mm", |e| e.rmse_3d_mm),
        ("depth, mm", |e| e.depth_rmse_mm),
        ("registration, px", |e| e.registration_rmse_px),
    ];
    let rows: Vec<(&str, Vec<Chart>)> = (series.iter().filter(|series| series.rows.len() > 2))
        .map(|series| {
            let last = series.rows.iter().map(|row| row.level).fold(0.0, f64::max);
            let chart = |(metric, value): (&str, Value)| {
                let curve = |color, fitted: bool| Curve {
                    color,
                    points: (series.rows.iter())
                        .filter_map(|row| {
                            let summary = if fitted { &row.fitted } else { &row.start };
                            Some((row.level, value(&summary.median)?))
                        })
                        .collect(),
                };
                Chart {
                    title: metric.to_owned(),
                    x_name: series.unit.to_owned(),
                    curves: vec![curve(START, false), curve(FITTED, true)],
                    logarithmic: true,
                    last,
                    size: SIZE,
                }
            };
            (series.name, metrics.into_iter().map(chart).collect())
        })
        .collect();
    let (width, height) = rows.first()?.1.first()?.full_size();
    let height = HEADING + height;
    let mut canvas = Canvas::new(metrics.len() * width, LEGEND + rows.len() * height, PAPER);
    let names = [
        (START, "maps that the fit starts from (median over frames)"),
        (FITTED, "fitted mesh"),
    ];
    legend(&mut canvas, &names, LEFT, LEGEND as f64 / 2.0);
    for (i, (name, row)) in rows.iter().enumerate() {
        let top = LEGEND + i * height;
        let middle = top as f64 + HEADING as f64 / 2.0;
        canvas.write(
            name,
            (LEFT, middle),
            Align::Left,
            Lettering::semibold(TITLE_SIZE + 1.0, INK),
        );
        for (j, chart) in row.iter().enumerate() {
            chart.draw(&mut canvas, j * width, top + HEADING);
        }
    }
    Some(canvas.into_picture())
}

/// Draws what the colours of curves stand for, from `left` on with its middle at height `middle`.
fn legend(canvas: &mut Canvas, entries: &[([u8; 3], &str)], left: f64, middle: f64) {
    let lettering = Lettering::regular(NUMBER_SIZE, INK);
    let mut x = left;
    for &(color, name) in entries {
        canvas.line(&[(x, middle), (x + LEGEND_LINE, middle)], 2.0, color);
        canvas.dot((x + LEGEND_LINE / 2.0, middle), 3.0, color);
        x += LEGEND_LINE + LEGEND_GAP;
        canvas.write(name, (x, middle), Align::Left, lettering);
        x += lettering.width(name) + 3.0 * LEGEND_GAP;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::study::fit::outcome::{ErrorSummary, Level};
    use crate::study::fit::plan::Start;

    fn series(levels: &[f64]) -> Series {
        let summary = |value: f64| {
            let errors = Errors {
                rmse_3d_mm: Some(value),
                depth_rmse_mm: Some(value),
                registration_rmse_px: Some(value),
                ..Errors::default()
            };
            ErrorSummary {
                mean: errors,
                median: errors,
            }
        };
        Series {
            name: "blur",
            unit: "px",
            start: Start::Network,
            rows: (levels.iter())
                .map(|&level| Level {
                    level,
                    frames: 1,
                    found: 1,
                    not_fitted: 0,
                    fallback_fraction: None,
                    worse_registration_fraction: None,
                    worse_3d_fraction: None,
                    start: summary(10.0),
                    fitted: summary(1.0),
                    mesh_rmse_mm: None,
                })
                .collect(),
        }
    }

    #[test]
    fn the_better_answer_is_drawn_below_the_worse() {
        let plot = study_plot(&[series(&[0.0, 1.0, 2.0]), series(&[1.0, 2.0])]).unwrap();
        let rows_of = |color: [u8; 3]| {
            let charts = LEGEND..plot.height();
            let rows = charts.filter(|&y| (0..plot.width()).any(|x| plot.pixel(x, y) == color));
            rows.collect::<Vec<usize>>()
        };
        let (start, fitted) = (rows_of(START), rows_of(FITTED));
        assert!(start.iter().max().unwrap() < fitted.iter().min().unwrap());
        // One row of charts: the series of two levels is no curve.
        assert!(plot.height() < 2 * SIZE.1 + LEGEND);
        assert!(study_plot(&[series(&[1.0, 2.0])]).is_none());
    }
}
