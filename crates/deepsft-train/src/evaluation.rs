//! Measuring a model on frames whose truth is known or whose depth was measured.

mod accuracy_table;
mod evaluate;
mod evaluation_frame;
mod measured_depth;
mod report;
pub mod tracking_errors;

pub use accuracy_table::accuracy_table;
pub use evaluate::{Evaluation, EvaluationSummary, FitSummary, FrameResult, MeasuredPixels, SetMetrics};
pub use evaluation_frame::{EvaluationFrame, FrameTruth};
pub use report::{EvaluationReport, FrameReport, reports_to_json};

pub(crate) use measured_depth::{eroded, measured_maps, trusted_depth};
