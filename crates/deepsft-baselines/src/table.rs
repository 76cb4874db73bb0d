//! Errors of methods over frames, and the table of them.

use crate::methods::Method;
use anyhow::Result;
use deepsft_geometry::metrics::{Summary, frame_metrics};
use deepsft_geometry::{Maps, Template, photo_consistency_error};
use deepsft_synth::Sample;
use serde::Serialize;
use serde_json::{Value, json};

/// What a method made of a frame; empty where it answered nothing.
#[derive(Clone, Copy, Debug, Default, Serialize)]
pub struct FrameErrors {
    /// RMSE of depth, mm.
    pub depth_rmse_mm: Option<f64>,
    /// RMSE of registration, pixels of the 480 x 270 image.
    pub registration_rmse_px: Option<f64>,
    /// E_pr of the paper, over the pixels that truth and answer have in common.
    pub photo_consistency_error: Option<f64>,
    /// Fraction of the true mask that is answered.
    pub coverage: Option<f64>,
    /// Processor time of the answer, s.
    pub seconds: f64,
}

impl FrameErrors {
    /// The errors of the `answer` of `method`, which took `seconds`, against the truth of `sample`.
    ///
    /// # Errors
    /// When the answer is not of the size of the sample.
    pub fn of(
        method: Method,
        answer: Option<&Maps>,
        sample: &Sample,
        template: &Template,
        seconds: f64,
    ) -> Result<Self> {
        let Some(answer) = answer else {
            return Ok(Self {
                seconds,
                ..Self::default()
            });
        };
        let mut seen = answer.clone();
        for pixel in (0..seen.depth().len()).filter(|&pixel| !sample.truth.inside(pixel)) {
            seen.clear(pixel);
        }
        let metrics = frame_metrics(&seen, &sample.truth, &sample.camera, template)?;
        Ok(Self {
            depth_rmse_mm: metrics.depth_rmse_mm.filter(|_| method.has_depth()),
            registration_rmse_px: metrics.registration_rmse_px,
            photo_consistency_error: photo_consistency_error(&sample.image, template.texture(), &seen),
            coverage: metrics.coverage,
            seconds,
        })
    }
}

/// A row of the table: a method and its errors, frame by frame.
#[derive(Debug)]
pub struct Row {
    /// The method.
    pub method: Method,
    /// One entry per frame.
    pub frames: Vec<FrameErrors>,
}

impl Row {
    fn summary(&self, of: fn(&FrameErrors) -> Option<f64>) -> Option<Summary> {
        Summary::of(self.frames.iter().map(of))
    }

    /// Frames in which it found something.
    fn answered(&self) -> usize {
        self.frames
            .iter()
            .filter(|frame| frame.coverage.is_some_and(|covered| covered > 0.0))
            .count()
    }

    /// Frames per second of processor time.
    fn frames_per_second(&self) -> f64 {
        self.frames.len() as f64 / self.frames.iter().map(|frame| frame.seconds).sum::<f64>()
    }

    fn registration(&self) -> Option<Summary> {
        self.summary(|frame| frame.registration_rmse_px)
    }

    /// The row as JSON: means at the top, medians in `median`, every frame in `per_frame`.
    fn json(&self) -> Value {
        let columns = [
            ("depth_rmse_mm", self.summary(|frame| frame.depth_rmse_mm)),
            ("registration_rmse_px", self.registration()),
            (
                "photo_consistency_error",
                self.summary(|frame| frame.photo_consistency_error),
            ),
            ("coverage", self.summary(|frame| frame.coverage)),
        ];
        let of = |value: fn(Summary) -> f64| -> serde_json::Map<String, Value> {
            columns
                .iter()
                .map(|(name, summary)| ((*name).to_owned(), json!(summary.map(value))))
                .collect()
        };
        let mut row = of(|summary| summary.mean);
        row.insert("method".to_owned(), json!(self.method.label()));
        row.insert("answered".to_owned(), json!(self.answered()));
        row.insert("frames_per_second".to_owned(), json!(self.frames_per_second()));
        row.insert("median".to_owned(), json!(of(|summary| summary.median)));
        row.insert("per_frame".to_owned(), json!(self.frames));
        Value::Object(row)
    }
}

/// The table in Markdown.
pub fn markdown(rows: &[Row]) -> String {
    let mut lines = vec![
        "| method | answered | depth RMSE, mm | registration RMSE, px | E_pr | coverage | frames per processor second |"
            .to_owned(),
        "|---|---|---|---|---|---|---|".to_owned(),
    ];
    let number = |summary: Option<Summary>, digits: usize| match summary {
        Some(Summary { mean, median, .. }) => format!("{mean:.digits$} / **{median:.digits$}**"),
        None => "-".to_owned(),
    };
    for row in rows {
        let registration = match row.method.is_registered() {
            true => "given".to_owned(),
            false => number(row.registration(), 2),
        };
        lines.push(format!(
            "| {} | {} of {} | {} | {registration} | {} | {} | {:.2} |",
            row.method.label(),
            row.answered(),
            row.frames.len(),
            number(row.summary(|frame| frame.depth_rmse_mm), 2),
            number(row.summary(|frame| frame.photo_consistency_error), 3),
            row.summary(|frame| frame.coverage)
                .map_or_else(|| "-".to_owned(), |covered| format!("{:.2}", covered.mean)),
            row.frames_per_second(),
        ));
    }
    lines.join("\n")
}

/// The table as JSON, with the `command` that made it.
///
/// # Errors
/// Never: all values are numbers and words.
pub fn json_bytes(rows: &[Row], command: &str) -> Result<Vec<u8>> {
    let rows: Vec<Value> = rows.iter().map(Row::json).collect();
    let version = env!("CARGO_PKG_VERSION");
    Ok(serde_json::to_vec_pretty(
        &json!({"command": command, "deepsft_version": version, "rows": rows}),
    )?)
}
