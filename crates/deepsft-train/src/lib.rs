#![doc = include_str!("../README.md")]
#![cfg_attr(test, allow(clippy::unwrap_used, clippy::expect_used, clippy::panic))]

mod config;
mod data;
mod error;
mod evaluation;
mod loss;
mod run;
mod supervised;
mod tuning;

/// Tensors and devices in this interface are those of this version of burn.
pub use burn;
/// What a training computes on, see `deepsft_network::start_device`.
pub use burn::tensor::Device;

pub use config::{Budget, LearningRate, Optimizer, Schedule, TrainConfig, TuningSettings, TuningStep};
pub use data::{BatchShape, SampleSource, StoredSamples};
pub use error::TrainError;
pub use evaluation::{
    Evaluation, EvaluationFrame, EvaluationReport, EvaluationSummary, FitSummary, FrameReport, FrameResult, FrameTruth,
    MeasuredPixels, SetMetrics, accuracy_table, reports_to_json, tracking_errors,
};
pub use loss::{DepthLoss, Light, PhotoConsistencyLoss, Residual};
pub use run::{
    CARD_FILE, CURVE_FILE, Checkpoint, CheckpointFolder, CurvePoint, Fingerprint, NETWORK_FILE, Progress, Saved,
    SavedFiles, TrainingCourse, curve_csv, model_card,
};
pub use supervised::{ACCURACY_SEED, ModelLabel, Trained, export_bundle, train};
pub use tuning::{
    MeanMedian, RecordedFrames, RecordingMetrics, TrainingFrame, Tuned, TuningSet, set_aside_outdated, tune,
    tuning_json, tuning_table,
};
