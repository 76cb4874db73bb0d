//! Measuring a model on frames whose truth is known or whose depth was measured.

mod evaluate;
mod evaluation_frame;
mod measured_depth;

pub use evaluate::{Evaluation, EvaluationSummary, Figures, FrameRefinement, FrameResult, RefinementSummary};
pub use evaluation_frame::{EvaluationFrame, FrameTruth};

pub(crate) use measured_depth::depth_counts;
