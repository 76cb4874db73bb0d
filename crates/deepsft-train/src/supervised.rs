//! Training step 1 (paper, section 4): all blocks, on synthetic samples.

mod export;
mod training;
mod trunk;

pub use export::{ACCURACY_SEED, ModelLabel, export_bundle};
pub use training::{Trained, train};
