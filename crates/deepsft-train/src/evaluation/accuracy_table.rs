//! The one table of evaluations, as text.

use super::SetMetrics;
use super::report::EvaluationReport;
use std::fmt::Write;

/// A figure of a row.
type Figure = fn(&SetMetrics) -> Option<f64>;

/// The columns of figures: the two lines above them, what stands in them and with how many digits.
const COLUMNS: [([&str; 2], Figure, usize); 8] = [
    (["depth", "mm"], |f| f.depth_rmse_mm, 2),
    (["registr.", "px"], |f| f.registration_rmse_px, 2),
    (["registr.", "mm"], |f| f.registration_rmse_mm, 2),
    (["E_pr", ""], |f| f.photo_consistency_error, 4),
    (["IoU", ""], |f| f.mask_iou, 4),
    (["coverage", ""], |f| f.coverage, 4),
    (["3D", "mm"], |f| f.rmse_3d_mm, 2),
    (["frames/s", ""], |f| f.frames_per_second, 2),
];

/// Characters of a column of figures.
const WIDTH: usize = 9;

/// Formats the accuracy of `rows` as a table, two lines per row. Remarks on each say how many frames it is of and what was not
/// found.
pub fn accuracy_table(rows: &[EvaluationReport]) -> String {
    let name = |row: &EvaluationReport| match row.stage {
        Some(stage) => format!("{}, {stage}", row.model),
        None => row.model.clone(),
    };
    let longest = |of: &dyn Fn(&EvaluationReport) -> String, title: &str| {
        let names = rows.iter().map(|row| of(row).chars().count());
        names.max().unwrap_or(0).max(title.len())
    };
    let model_width = longest(&name, "model");
    let set_width = longest(&|row| row.set.clone(), "data set");
    let mut text = String::new();
    let mut line = |model: &str, set: &str, statistic: &str, cells: [String; COLUMNS.len()]| {
        let mut line = format!("{model:model_width$}  {set:set_width$}  {statistic:6}");
        for cell in cells {
            // Writing to a string does not fail.
            let _ = write!(line, " {cell:>WIDTH$}");
        }
        let _ = writeln!(text, "{}", line.trim_end());
    };
    line("model", "data set", "", COLUMNS.map(|(title, ..)| title[0].to_owned()));
    line("", "", "", COLUMNS.map(|(title, ..)| title[1].to_owned()));
    for row in rows {
        let cells = |figures: &SetMetrics| COLUMNS.map(|(_, figure, digits)| number(figure(figures), digits));
        line(&name(row), &row.set, "mean", cells(&row.summary.mean));
        line("", "", "median", cells(&row.summary.median));
    }
    for row in rows {
        let _ = write!(text, "\n{} on {}: {}", name(row), row.set, remarks(row));
    }
    text
}

/// A number, or a dash where there is none.
fn number(value: Option<f64>, digits: usize) -> String {
    value.map_or_else(|| "-".to_owned(), |value| format!("{value:.digits$}"))
}

/// Of how many frames a row is, and where the model does not answer as it should.
fn remarks(row: &EvaluationReport) -> String {
    let summary = &row.summary;
    let percent = |fraction: Option<f64>| number(fraction.map(|fraction| 100.0 * fraction), 1) + " %";
    let mut parts = vec![format!(
        "{} of {} frames show the object",
        summary.frames_with_template, summary.frames
    )];
    if summary.found_fraction.is_some() {
        parts.push(format!("it is found in {} of them", percent(summary.found_fraction)));
    }
    if summary.empty_flagged_fraction.is_some() {
        let flagged = percent(summary.empty_flagged_fraction);
        parts.push(format!("not found in {flagged} of those without it"));
    }
    if summary.frames_without_answer > 0 {
        parts.push(format!(
            "{} that show it have no pixel in common with the answer",
            summary.frames_without_answer
        ));
    }
    if let Some(pixels) = summary.measured_pixels {
        parts.push(format!(
            "its depth is compared at {} of the {} pixels that the depth camera has for comparison",
            pixels.compared, pixels.measured
        ));
    }
    if let Some(fit) = &summary.fit {
        parts.push(format!(
            "a mesh was fitted to {}: {} of them are worse than the network's maps in registration, {} in 3D",
            fit.frames,
            percent(Some(fit.worse_registration_fraction)),
            percent(Some(fit.worse_3d_fraction)),
        ));
    }
    parts.join("; ")
}
