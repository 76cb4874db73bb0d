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
    (["E_pr", ""], |f| f.photometric_error, 4),
    (["IoU", ""], |f| f.mask_iou, 4),
    (["coverage", ""], |f| f.coverage, 4),
    (["3D", "mm"], |f| f.rmse_3d_mm, 2),
    (["frames/s", ""], |f| f.frames_per_second, 2),
];

/// Characters of a column of figures.
const WIDTH: usize = 9;

/// The table of `rows`, two lines per row, and remarks on each: how many frames it is of, what was not found.
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
            "a mesh was fitted to {}: in {} of them the network's maps stay, {} are worse than these in registration, {} in 3D",
            fit.frames,
            percent(Some(fit.rejected_fraction)),
            percent(Some(fit.worse_registration_fraction)),
            percent(Some(fit.worse_3d_fraction)),
        ));
    }
    parts.join("; ")
}

#[cfg(test)]
mod tests {
    use super::super::{Evaluation, FrameResult, reports_to_json};
    use super::*;
    use deepsft::{Judgement, Stage};
    use deepsft_geometry::metrics::FrameMetrics;

    fn row(model: &str, set: &str, stage: Option<Stage>, depths: &[f64]) -> EvaluationReport {
        let frame = |(index, &depth): (usize, &f64)| FrameResult {
            index: index as u64,
            has_template: true,
            judgement: Judgement {
                found: true,
                confidence: 0.5,
                area: 0.1,
            },
            metrics: FrameMetrics {
                depth_rmse_mm: Some(depth),
                coverage: Some(0.75),
                ..FrameMetrics::default()
            },
            photometric_error: Some(0.125),
            measured_pixels: None,
            fit: None,
            seconds: Some(0.25),
        };
        let evaluation = Evaluation {
            frames: depths.iter().enumerate().map(frame).collect(),
        };
        EvaluationReport::new(model, stage, set, &evaluation, "cpu")
    }

    #[test]
    fn each_model_and_set_has_a_line_of_means_and_one_of_medians() {
        let rows = [
            row("poster", "set a", None, &[1.0, 2.0, 6.0]),
            row("cup", "a longer name", Some(Stage::Main), &[]),
        ];
        let text = accuracy_table(&rows);
        let words = |line: usize| -> Vec<&str> { text.lines().nth(line).unwrap().split_whitespace().collect() };
        let header = "model data set depth registr. registr. E_pr IoU coverage 3D frames/s";
        assert_eq!(words(0).join(" "), header);
        assert_eq!(words(1), ["mm", "px", "mm", "mm"]);
        assert_eq!(words(2).join(" "), "poster set a mean 3.00 - - 0.1250 - 0.7500 - 4.00");
        assert_eq!(words(3).join(" "), "median 2.00 - - 0.1250 - 0.7500 - 4.00");
        assert_eq!(
            words(4).join(" "),
            "cup, main block only a longer name mean - - - - - - - -"
        );
        // The figures stand below each other: lines that are as long end at the same column.
        let ends: Vec<usize> = [0, 2, 3].map(|line| text.lines().nth(line).unwrap().len()).to_vec();
        assert_eq!(ends, [ends[0]; 3]);
        assert!(text.contains("poster on set a: 3 of 3 frames show the object; it is found in 100.0 % of them"));
    }

    #[test]
    fn a_single_row_is_the_whole_json_and_several_are_a_list() {
        let rows = [row("a", "x", None, &[1.0]), row("b", "x", Some(Stage::Main), &[2.0])];
        let json = |rows: &[EvaluationReport]| -> serde_json::Value {
            serde_json::from_slice(&reports_to_json(rows).unwrap()).unwrap()
        };
        let one = json(&rows[..1]);
        assert_eq!((&one["model"], &one["depth_rmse_mm"]), (&"a".into(), &1.0.into()));
        assert!(one.get("stage").is_none() && one.get("rows").is_none());
        let both = json(&rows);
        assert_eq!(both["rows"][1]["stage"], "main block only");
        assert_eq!(both["rows"][1]["median"]["frames_per_second"], 4.0);
        assert_eq!(both["rows"].as_array().unwrap().len(), 2);
    }
}
