//! Errors of methods over frames, and the table of them.

use crate::stopwatch::hardware;
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
    /// Processor time of the answer, s, where it was taken.
    pub seconds: Option<f64>,
}

/// What of an answer counts.
#[derive(Clone, Copy, Debug)]
pub struct Measured {
    /// Its depth.
    pub depth: bool,
    /// Its registration.
    pub registration: bool,
    /// That registration was given to it.
    pub given: bool,
}

impl FrameErrors {
    /// The errors of an `answer`, which took `seconds`, against the truth of `sample`.
    ///
    /// # Errors
    /// When the answer is not of the size of the sample.
    pub fn of(
        measured: Measured,
        answer: Option<&Maps>,
        sample: &Sample,
        template: &Template,
        seconds: Option<f64>,
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
            depth_rmse_mm: metrics.depth_rmse_mm.filter(|_| measured.depth),
            registration_rmse_px: metrics.registration_rmse_px.filter(|_| measured.registration),
            photo_consistency_error: photo_consistency_error(&sample.image, template.texture(), &seen)
                .filter(|_| measured.registration),
            coverage: metrics.coverage,
            seconds,
        })
    }
}

/// A row of the table: a method and its errors, frame by frame.
#[derive(Debug)]
pub struct Row {
    /// Its name.
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
    fn frames_per_second(&self) -> Option<f64> {
        let seconds: Option<f64> = self.frames.iter().map(|frame| frame.seconds).sum();
        seconds.filter(|s| *s > 0.0).map(|s| self.frames.len() as f64 / s)
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
}

/// The table in Markdown; with what the paper says, if any row has that.
pub fn markdown(rows: &[Row]) -> String {
    let has_paper = rows.iter().any(|row| row.paper.is_some());
    let more = |cells: &str| {
        if has_paper {
            format!(" {cells} |")
        } else {
            String::new()
        }
    };
    let mut lines = vec![
        format!(
            "| method | answered | depth RMSE, mm | registration RMSE, px | E_pr | coverage | frames per processor second |{}",
            more("the paper: depth, mm | registration, px | frames per second")
        ),
        format!("|---|---|---|---|---|---|---|{}", more("---|---|---").replace(' ', "")),
    ];
    let number = |summary: Option<Summary>, digits: usize| match summary {
        Some(Summary { mean, median, .. }) => format!("{mean:.digits$} / **{median:.digits$}**"),
        None => "-".to_owned(),
    };
    for row in rows {
        let paper = more(&row.paper.unwrap_or(["-"; 3]).join(" | "));
        if let Some(missing) = &row.missing {
            lines.push(format!("| {} | {missing} | - | - | - | - | - |{paper}", row.label));
            continue;
        }
        let registration = match row.measured.given {
            true => "given".to_owned(),
            false => number(row.registration(), 2),
        };
        lines.push(format!(
            "| {} | {} of {} | {} | {registration} | {} | {} | {} |{paper}",
            row.label,
            row.answered(),
            row.frames.len(),
            number(row.summary(|frame| frame.depth_rmse_mm), 2),
            number(row.summary(|frame| frame.photo_consistency_error), 3),
            row.summary(|frame| frame.coverage)
                .map_or_else(|| "-".to_owned(), |covered| format!("{:.2}", covered.mean)),
            (row.frames_per_second().map(|rate| format!("{rate:.2}")))
                .or_else(|| row.stated.clone())
                .unwrap_or_else(|| "-".to_owned()),
        ));
    }
    lines.push(format!("\nMean / median. Our times are on {}.", hardware()));
    lines.join("\n")
}

/// The table as JSON, with the `command` that made it.
pub fn json(rows: &[Row], command: &str) -> Value {
    let rows: Vec<Value> = rows.iter().map(Row::json).collect();
    let version = env!("CARGO_PKG_VERSION");
    json!({"command": command, "hardware": hardware(), "deepsft_version": version, "rows": rows})
}
