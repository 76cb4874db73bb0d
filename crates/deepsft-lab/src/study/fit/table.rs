//! The figures of a study as a table, in Markdown so that it can be pasted.

use super::outcome::{Errors, Series};
use super::plan::Start;
use std::fmt::Write;

/// One table per series: medians before and after the fit, means after it in brackets.
pub fn study_table(series: &[Series]) -> String {
    let mut text = String::new();
    for series in series {
        let start = match series.start {
            Start::DisturbedTruth => "the truth, disturbed",
            Start::Network => "the network's maps",
        };
        // Writing to a string cannot fail.
        let _ = writeln!(
            text,
            "\n{} (start: {start})\n\n\
             | {} | found | 3D, mm | depth, mm | registration, px | whole mesh, mm | depth / true | fallback | worse px / 3D |\n\
             |---|---|---|---|---|---|---|---|---|",
            series.name, series.unit
        );
        for row in &series.rows {
            let change = |error: fn(&Errors) -> Option<f64>, decimals: usize| {
                let number =
                    |value: Option<f64>| value.map_or_else(|| "-".to_owned(), |value| format!("{value:.decimals$}"));
                let [before, after, mean] =
                    [&row.start.median, &row.fitted.median, &row.fitted.mean].map(|errors| number(error(errors)));
                format!("{before} -> **{after}** ({mean})")
            };
            let percent =
                |fraction: Option<f64>| fraction.map_or_else(|| "-".to_owned(), |s| format!("{:.0} %", 100.0 * s));
            let number = |value: Option<f64>, decimals: usize| {
                value.map_or_else(|| "-".to_owned(), |value| format!("{value:.decimals$}"))
            };
            let _ = writeln!(
                text,
                "| {} | {} of {} | {} | {} | {} | {} | {} | {} | {} / {} |",
                row.level,
                row.found,
                row.frames,
                change(|e| e.rmse_3d_mm, 1),
                change(|e| e.depth_rmse_mm, 1),
                change(|e| e.registration_rmse_px, 2),
                number(row.mesh_rmse_mm, 1),
                number(row.fitted.median.depth_ratio, 3),
                percent(row.fallback_fraction),
                percent(row.worse_registration_fraction),
                percent(row.worse_3d_fraction),
            );
        }
    }
    text
}
