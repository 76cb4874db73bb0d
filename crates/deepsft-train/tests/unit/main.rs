//! What the crate makes public, piece by piece.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

mod ablation;
mod accuracy_table;
mod bilinear_warp;
mod checkpoint;
mod depth_loss;
mod evaluation_frame;
mod evaluation_summary;
mod fingerprint;
mod gradients;
mod model_card;
mod optimizer;
mod photo_consistency_loss;
mod stored_samples;
mod supervised_maps_loss;
mod total_variation;
mod tracking_errors;
mod tuning_table;
