//! Batches of synthetic samples: where samples come from, what a network is to learn of them, and the workers that make
//! batches.

mod cell_targets;
mod loader;
mod map_batch;
mod sample_source;
mod window_batch;

pub use sample_source::{SampleSource, StoredSamples};
pub use window_batch::BatchShape;

pub(crate) use loader::{Loader, TrainingBatch};
pub(crate) use window_batch::BatchTensors;
