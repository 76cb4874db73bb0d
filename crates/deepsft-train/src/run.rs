//! What all training steps have in common: the loop, its checkpoints and its reports, the card of a model.

mod checkpoint;
mod fingerprint;
mod model_card;
mod progress;
mod training_run;
mod weight_average;

pub use checkpoint::{Checkpoint, CheckpointFolder, CurvePoint, NETWORK_FILE, Saved, SavedFiles};
pub use fingerprint::Fingerprint;
pub use model_card::{CARD_FILE, CURVE_FILE, TrainingCourse, curve_csv, model_card};
pub use progress::Progress;

pub(crate) use training_run::{Finished, RunSettings, TrainingStep, run};
