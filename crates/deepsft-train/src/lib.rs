//! Training and evaluation of Shape-from-Template networks. Native only.

#![cfg_attr(test, allow(clippy::unwrap_used, clippy::expect_used, clippy::panic))]

mod average;
mod batch;
mod checkpoint;
mod error;
mod evaluate;
mod export;
mod loader;
mod loss;
mod schedule;
mod study;
mod targets;
mod trainer;

pub use batch::{Batch, BatchShape, BatchTensors};
pub use checkpoint::{Checkpoint, CurvePoint};
pub use error::TrainError;
pub use evaluate::{Evaluation, EvaluationSummary, Figures, FrameRefinement, FrameResult, RefinementSummary};
pub use export::export_bundle;
pub use loss::{
    DepthLoss, Light, LossWeights, Losses, PhotoConsistencyLoss, Reduction, RefinementLoss, Residual, TexturePyramid,
    squared_total_variation, step_one_loss,
};
pub use schedule::Schedule;
pub use study::{
    StudyErrors, StudyFrame, StudyOutcome, StudyRow, StudySeries, StudyStart, StudySummary, study_length, study_physics,
};
pub use trainer::{Budget, Progress, TrainConfig, Trained, train};
