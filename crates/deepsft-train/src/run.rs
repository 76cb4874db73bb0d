//! What all training steps have in common: checkpoints and reports.

mod checkpoint;
mod progress;

pub use checkpoint::{Checkpoint, CurvePoint, existing_checkpoints};
pub use progress::Progress;

pub(crate) use checkpoint::CheckpointFolder;
