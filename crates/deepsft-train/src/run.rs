//! What all training steps have in common: the loop, its checkpoints and its reports.

mod checkpoint;
mod fingerprint;
mod progress;
mod training_run;

pub use checkpoint::{Checkpoint, CurvePoint, existing_checkpoints};
pub use fingerprint::Fingerprint;
pub use progress::Progress;

pub(crate) use checkpoint::CheckpointFolder;
pub(crate) use training_run::{Finished, RunSettings, TrainingStep, run};
