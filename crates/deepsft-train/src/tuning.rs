//! Training steps 2 and 3 (paper, section 4): one refinement block, on a recording, everything else frozen.
//!
//! Batch normalisation is not trained here: a bundle holds folded weights, in which it is a part of the convolutions, and a
//! tuning starts from a bundle. The paper does not say what it does. Frozen statistics are the usual choice in fine-tuning:
//! the six or seven frames of a batch are of one recording, and their statistics are not those of other places.

mod fingerprint;
mod recorded_frames;
mod recording_metrics;
mod report;
mod training_frame;
mod tune;

pub use fingerprint::set_aside_outdated;
pub use recorded_frames::{RecordedFrames, TuningSet};
pub use recording_metrics::{MeanMedian, RecordingMetrics};
pub use report::{tuning_json, tuning_table};
pub use training_frame::TrainingFrame;
pub use tune::{Tuned, tune};
