//! The one error type of this crate.

use std::path::PathBuf;
use thiserror::Error;

/// What can stop a training or an evaluation.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum TrainError {
    /// A checkpoint was made with another configuration.
    #[error("checkpoint was made with another {what}; remove it or train without --resume: {path}")]
    CheckpointMismatch {
        /// What differs.
        what: String,
        /// The checkpoint folder.
        path: PathBuf,
    },
    /// The loss is no longer a finite number.
    #[error("loss is {loss} after {samples} samples; lower the learning rate")]
    Diverged {
        /// The loss met.
        loss: f64,
        /// Samples seen.
        samples: u64,
    },
    /// A weight is no finite number. What was saved before stays.
    #[error(
        "a weight is no longer a finite number after {samples} samples; lower the learning rate. \
         The checkpoint of before stays: {path}"
    )]
    WeightsNotFinite {
        /// Samples seen.
        samples: u64,
        /// The checkpoint folder.
        path: PathBuf,
    },
    /// This way of training is for another architecture.
    #[error("a network of the architecture {actual} cannot be trained in this way, only {expected}")]
    Architecture {
        /// Architecture of the network.
        actual: &'static str,
        /// Architecture that is trained so.
        expected: &'static str,
    },
    /// Data sets are too small to hold a part out.
    #[error("{actual} samples are too few to train on: {expected} at least, as the last tenth is held out")]
    TooFewSamples {
        /// Samples of all data sets.
        actual: u64,
        /// Fewest samples.
        expected: u64,
    },
    /// Two data sets have a sample in common.
    #[error("sample {index} of seed {seed} is in two of the data sets: it might be trained on and held out")]
    RepeatedSample {
        /// Seed of both.
        seed: u64,
        /// Index of the first such sample.
        index: u64,
    },
    /// A sample's mesh is not that of the model's template.
    #[error("its mesh has {actual} vertices, the model's template {expected}")]
    VertexCount {
        /// Vertices of the sample.
        actual: usize,
        /// Vertices of the template.
        expected: usize,
    },
    /// A worker that makes samples stopped.
    #[error("a data worker stopped before the training did")]
    WorkerStopped,
    /// The core library refused something.
    #[error(transparent)]
    Core(#[from] deepsft::DeepSftError),
    /// The network or its device refused something.
    #[error(transparent)]
    Network(#[from] deepsft_network::NetworkError),
    /// The synthesiser refused something.
    #[error(transparent)]
    Synth(#[from] deepsft_synth::SynthError),
    /// A file of a checkpoint or a data set, weights to begin with, or a recording was refused.
    #[error(transparent)]
    Format(#[from] deepsft_formats::FormatError),
    /// Maps of different sizes were compared.
    #[error(transparent)]
    Geometry(#[from] deepsft_geometry::GeometryError),
}
