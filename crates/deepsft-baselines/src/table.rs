//! Errors of methods over frames, and the table of them.

use crate::stopwatch::hardware;
use anyhow::Result;
use deepsft_formats::write_file;
use deepsft_geometry::metrics::{Summary, frame_metrics};
use deepsft_geometry::{Maps, Template, photo_consistency_error};
use deepsft_synth::Sample;
use serde::Serialize;
use serde_json::{Value, json};
use std::path::Path;

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
    /// Processor time of the answer, s, where it was taken.
    pub seconds: Option<f64>,
}

/// What of an answer counts.
#[derive(Clone, Copy, Debug, Default)]
pub struct Measured {
    pub depth: bool,
    pub registration: bool,
    /// That registration was given to it.
    pub given: bool,
}

impl FrameErrors {
    /// The errors of an `answer`, which took `seconds`, against the truth of `sample`.
    /// Fails when the answer is not of the size of the sample.
    pub fn of(
        measured: Measured,
        answer: Option<&Maps>,
        sample: &Sample,
        template: &Template,
        seconds: Option<f64>,
    ) -> Result<Self> {
        let nothing = Self {
            seconds,
            ..Self::default()
        };
        let Some(mut seen) = answer.cloned() else {
            return Ok(nothing);
        };
        for pixel in (0..seen.depth().len()).filter(|&pixel| !sample.truth.inside(pixel)) {
            seen.clear(pixel);
        }
        let metrics = frame_metrics(&seen, &sample.truth, &sample.camera, template)?;
        let photo_consistency = photo_consistency_error(&sample.image, template.texture(), &seen);
        Ok(Self {
            depth_rmse_mm: metrics.depth_rmse_mm.filter(|_| measured.depth),
            registration_rmse_px: metrics.registration_rmse_px.filter(|_| measured.registration),
            photo_consistency_error: photo_consistency.filter(|_| measured.registration),
            coverage: metrics.coverage,
            seconds,
        })
    }
}

/// A row of the table: a method and its errors, frame by frame.
#[derive(Default)]
pub struct Row {
    pub label: String,
    /// What of its answers counts.
    pub measured: Measured,
    /// How fast and on what its authors say it is, where we did not take its time.
    pub stated: Option<String>,
    /// Why it is not run, if so.
    pub missing: Option<String>,
    /// One entry per frame.
    pub frames: Vec<FrameErrors>,
    /// What the paper has for it: depth and registration RMSE of each of its sets, frames per second.
    pub paper: Option<[&'static str; 3]>,
}

/// An error of a frame.
pub type Column = fn(&FrameErrors) -> Option<f64>;

pub const DEPTH: Column = |frame| frame.depth_rmse_mm;
pub const REGISTRATION: Column = |frame| frame.registration_rmse_px;
pub const PHOTO_CONSISTENCY: Column = |frame| frame.photo_consistency_error;
pub const COVERAGE: Column = |frame| frame.coverage;

impl Row {
    fn summary(&self, of: Column) -> Option<Summary> {
        Summary::of(self.frames.iter().map(of))
    }

    /// Frames in which it found something.
    fn answered(&self) -> usize {
        let covered = self.frames.iter().filter_map(COVERAGE);
        covered.filter(|covered| *covered > 0.0).count()
    }

    /// Frames per second of processor time.
    fn frames_per_second(&self) -> Option<f64> {
        let seconds: Option<f64> = self.frames.iter().map(|frame| frame.seconds).sum();
        seconds.filter(|s| *s > 0.0).map(|s| self.frames.len() as f64 / s)
    }

    /// The row as JSON: means at the top, medians in `median`, every frame in `per_frame`.
    fn json(&self) -> Value {
        let columns = [
            ("depth_rmse_mm", DEPTH),
            ("registration_rmse_px", REGISTRATION),
            ("photo_consistency_error", PHOTO_CONSISTENCY),
            ("coverage", COVERAGE),
        ];
        let of = |value: fn(Summary) -> f64| {
            let values = columns.map(|(name, of)| (name.to_owned(), json!(self.summary(of).map(value))));
            serde_json::Map::from_iter(values)
        };
        let mut row = of(|summary| summary.mean);
        row.insert("method".to_owned(), json!(self.label));
        row.insert("stated".to_owned(), json!(self.stated));
        row.insert("missing".to_owned(), json!(self.missing));
        row.insert("paper".to_owned(), json!(self.paper));
        row.insert("answered".to_owned(), json!(self.answered()));
        row.insert("frames_per_second".to_owned(), json!(self.frames_per_second()));
        row.insert("median".to_owned(), json!(of(|summary| summary.median)));
        row.insert("per_frame".to_owned(), json!(self.frames));
        Value::Object(row)
    }

    /// The cells under [`COLUMNS`].
    fn cells(&self) -> String {
        if let Some(missing) = &self.missing {
            return format!("{} | {missing} | - | - | - | - | -", self.label);
        }
        let or_none = |cell: Option<String>| cell.unwrap_or_else(|| "-".to_owned());
        let number = |of: Column, digits: usize| {
            let text = |Summary { mean, median, .. }| format!("{mean:.digits$} / **{median:.digits$}**");
            or_none(self.summary(of).map(text))
        };
        let registration = match self.measured.given {
            true => "given".to_owned(),
            false => number(REGISTRATION, 2),
        };
        let coverage = self.summary(COVERAGE).map(|covered| format!("{:.2}", covered.mean));
        let rate = self.frames_per_second().map(|rate| format!("{rate:.2}"));
        let cells = [
            self.label.clone(),
            format!("{} of {}", self.answered(), self.frames.len()),
            number(DEPTH, 2),
            registration,
            number(PHOTO_CONSISTENCY, 3),
            or_none(coverage),
            or_none(rate.or_else(|| self.stated.clone())),
        ];
        cells.join(" | ")
    }
}

/// Columns of the table, and what the paper says.
const COLUMNS: &str =
    "method | answered | depth RMSE, mm | registration RMSE, px | E_pr | coverage | frames per processor second";
const OF_PAPER: &str = "the paper: depth, mm | registration, px | frames per second";

/// The table in Markdown; with what the paper says, if any row has that.
pub fn markdown(rows: &[Row]) -> String {
    let has_paper = rows.iter().any(|row| row.paper.is_some());
    let line = |cells: &str, of_paper: &str| match has_paper {
        true => format!("| {cells} | {of_paper} |"),
        false => format!("| {cells} |"),
    };
    let columns = if has_paper { 10 } else { 7 };
    let mut lines = vec![line(COLUMNS, OF_PAPER), format!("|{}", "---|".repeat(columns))];
    let of_row = |row: &Row| line(&row.cells(), &row.paper.unwrap_or(["-"; 3]).join(" | "));
    lines.extend(rows.iter().map(of_row));
    lines.push(format!("\nMean / median. Our times are on {}.", hardware()));
    lines.join("\n")
}

/// The table as JSON, with the `command` that made it.
pub fn json(rows: &[Row], command: &str) -> Value {
    let rows: Vec<Value> = rows.iter().map(Row::json).collect();
    let version = env!("CARGO_PKG_VERSION");
    json!({"command": command, "hardware": hardware(), "deepsft_version": version, "rows": rows})
}

/// Writes table.md and table.json into `folder`.
/// Fails when a file cannot be written.
pub fn write(folder: &Path, markdown: &str, json: &Value) -> Result<()> {
    write_file(&folder.join("table.md"), format!("{markdown}\n").as_bytes())?;
    Ok(write_file(
        &folder.join("table.json"),
        &serde_json::to_vec_pretty(json)?,
    )?)
}
