//! Whole networks: every architecture, their bundles and layers, independent programs beside them, and a network in a video.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

mod architecture_bundles;
mod architectures;
mod executor;
mod layer_table;
mod network_golden;
mod resnet_golden;
mod video;

use burn::tensor::Device;
use deepsft::{Architecture, NetworkConfig};
use deepsft_geometry::training_camera;
use deepsft_network::{Block, Network};

/// A network for a sheet of A4.
fn network(architecture: Architecture) -> Network {
    let config = NetworkConfig::new(architecture, [297.0, 210.0], &training_camera());
    Network::new(&config, &Device::flex())
}

/// Values of a block's weights, by their paths.
fn block_parameters(network: &Network, block: Block) -> usize {
    let mut count = 0;
    network.each_weight(|path, values| {
        let part = match path.split('.').next() {
            Some("depth_refinement") => Block::DepthRefinement,
            Some("registration_refinement") => Block::RegistrationRefinement,
            _ => Block::Main,
        };
        count += if part == block { values.num_elements() } else { 0 };
    });
    count
}
