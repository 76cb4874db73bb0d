//! Whole networks: every architecture, their bundles and layers, independent programs beside them, and a network in a video.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

mod architecture_bundles;
mod architectures;
mod executor;
mod layer_table;
mod network_golden;
mod resnet_golden;
mod video;
