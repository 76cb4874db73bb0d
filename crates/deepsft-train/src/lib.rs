//! Training and evaluation of Shape-from-Template networks. Native only.

#![cfg_attr(test, allow(clippy::unwrap_used, clippy::expect_used, clippy::panic))]

mod average;
mod batch;
mod checkpoint;
mod config;
mod devices;
mod error;
mod evaluate;
mod evaluation_frame;
mod export;
mod loader;
mod loss;
mod map_batch;
mod optimizer;
mod precision;
mod recorded_frames;
mod recording_figures;
mod refinement;
mod refinement_fingerprint;
mod refinement_site;
mod sample_source;
mod schedule;
mod shares;
mod step;
mod step_one_fingerprint;
mod targets;
mod trainer;

/// What a training computes on, see `deepsft::start_device`.
pub use burn::tensor::Device;

pub use batch::{Batch, BatchShape, BatchTensors};
pub use checkpoint::{Checkpoint, CurvePoint, existing_checkpoints};
pub use config::{Budget, RefinementSteps, TrainConfig};
pub use error::TrainError;
pub use evaluate::{Evaluation, EvaluationSummary, Figures, FrameRefinement, FrameResult, RefinementSummary};
pub use evaluation_frame::{EvaluationFrame, FrameTruth};
pub use export::{ACCURACY_SEED, export_bundle};
pub use loss::{
    DepthLoss, Light, LossWeights, Losses, PhotoConsistencyLoss, Reduction, RefinementLoss, Residual, SupervisedLosses,
    TexturePyramid, squared_total_variation, step_one_loss, supervised_maps_loss,
};
pub use map_batch::{MapBatch, MapTensors};
pub use optimizer::{LearningRate, Optimizer};
pub use precision::{LossScale, Precision};
pub use recorded_frames::TrainingFrame;
pub use recording_figures::{MeanMedian, RecordingFigures};
pub use refinement::{RecordedFrames, Refined, RefinementData, RefinementStep, refine};
pub use refinement_fingerprint::set_aside_outdated;
pub use sample_source::{SampleSource, StoredSamples};
pub use schedule::Schedule;
pub use trainer::{Progress, Trained, train};
