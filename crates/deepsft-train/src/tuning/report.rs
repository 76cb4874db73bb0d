//! The metrics of steps 2 and 3 before and after, as a table and as JSON.

use super::recorded_frames::RecordedFrames;
use super::recording_metrics::{MeanMedian, RecordingMetrics};
use serde_json::{Value, json};

/// Figure of a row, means and medians.
type Figure = fn(&RecordingMetrics) -> Option<MeanMedian>;

/// The figures by their names, with their digits.
const FIGURES: [(&str, Figure, usize); 7] = [
    ("depth RMSE to the sensor, mm", |f| f.measured_depth_rmse_mm, 2),
    ("depth RMSE to the truth, mm", |f| f.depth_rmse_mm, 2),
    ("E_pr", |f| f.photo_consistency_error, 4),
    (
        "E_pr, camera's colours",
        |f| f.recorded_colors_photo_consistency_error,
        4,
    ),
    ("E_pr, light fitted", |f| f.relit_photo_consistency_error, 4),
    ("registration RMSE to the truth, px", |f| f.registration_rmse_px, 2),
    ("mask IoU", |f| f.mask_iou, 3),
];

/// Formats the metrics of `rows` as a table in Markdown. A row is a network before or after a step, or the truth itself, on the
/// `held_out` last frames of `all` of a recording of this `kind` (`recording`, `simulated recording`). Metrics that no frame
/// has are left out.
pub fn tuning_table(kind: &str, all: usize, held_out: usize, rows: &[(String, RecordingMetrics)]) -> String {
    let known: Vec<_> = FIGURES
        .iter()
        .filter(|(_, figure, _)| rows.iter().any(|(_, row)| figure(row).is_some()))
        .collect();
    let mut table = format!("Held-out end of the {kind}: {held_out} of {all} frames, mean / median\n\n|");
    for (name, figure, _) in &known {
        let counted = rows.iter().find_map(|(_, row)| figure(row));
        table += &format!(" | {name} ({} frames)", counted.map_or(0, |counted| counted.frames));
    }
    table += &format!(" |\n|{}\n", "---|".repeat(known.len() + 1));
    for (name, row) in rows {
        table += &format!("| {name}");
        for (_, figure, digits) in &known {
            table += &figure(row).map_or_else(
                || " | -".to_owned(),
                |MeanMedian { mean, median, .. }| format!(" | {mean:.digits$} / {median:.digits$}"),
            );
        }
        table += " |\n";
    }
    if let Some((_, row)) = rows.first() {
        let pixels = row.measured_depth_pixels;
        table +=
            &format!("\nThe depth RMSE to the sensor is over {pixels} pixels of these frames, the same in every row\n");
    }
    table
}

/// The same as JSON, with the numbers of frames and the colours of the camera.
///
/// # Errors
/// Those of the writer.
pub fn tuning_json(
    kind: &str,
    frames: &RecordedFrames,
    rows: &[(String, RecordingMetrics)],
) -> serde_json::Result<Vec<u8>> {
    let rows: Vec<Value> = rows
        .iter()
        .map(|(name, row)| Ok(json!({"when": name, "figures": serde_json::to_value(row)?})))
        .collect::<serde_json::Result<_>>()?;
    let value = json!({
        "recording": kind,
        "frames_trained_on": frames.training.len(),
        "frames_held_out": frames.held_out.len(),
        "colors": {"gain": frames.colors.gain, "offset": frames.colors.offset},
        "rows": rows,
    });
    serde_json::to_vec_pretty(&value)
}
