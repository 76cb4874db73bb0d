//! Measuring a model on frames whose truth is known or whose depth was measured.

mod evaluate;
mod evaluation_frame;
mod measured_depth;

pub use evaluate::{Evaluation, EvaluationSummary, FitSummary, FrameFit, FrameResult, MeasuredPixels, SetMetrics};
pub use evaluation_frame::{EvaluationFrame, FrameTruth};

pub(crate) use measured_depth::{comparable_depth, eroded, trusted_depth};
