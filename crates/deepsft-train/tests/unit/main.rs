//! What the crate makes public, piece by piece.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

mod ablation;
mod accuracy_table;
mod checkpoint;
mod evaluation_frame;
mod evaluation_summary;
mod fingerprint;
mod model_card;
mod optimizer;
mod stored_samples;
mod tracking_errors;
mod tuning_table;
