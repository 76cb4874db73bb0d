//! What all training steps have in common: checkpoints, reports, the card of a model.

mod checkpoint;
mod model_card;
mod progress;

pub use checkpoint::{Checkpoint, CurvePoint, existing_checkpoints};
pub use model_card::{CARD_FILE, CURVE_FILE, TrainingCourse, curve_csv, model_card};
pub use progress::Progress;

pub(crate) use checkpoint::CheckpointFolder;
