//! Networks: image in, depth and registration maps out.
//!
//! [`NetworkConfig`] says which architecture and how large, [`Network`] is any of them with its weights,
//! [`Network::forward_maps`] what training steps and tools need of it: the same maps from each.

mod any_network;
mod block;
mod compact;
mod description;
mod execution;
mod fold;
mod half_precision;
mod layer_table;
mod maps;
mod module;
mod paper;
mod r50f;
mod reading;
mod resnet;
mod trunk;
mod upsampling;
mod weight_array;

pub use any_network::Network;
pub use block::Block;
pub use compact::{
    CompactNetwork, DESCRIPTOR_LENGTH, DescriptorNetwork, INPUT_MULTIPLE, NetworkOutput, PIXELS_PER_CELL, SEAM_JUMP,
    cross_entropy,
};
pub use deepsft_inference::{Architecture, CompactConfig, DepthRange, NetworkConfig, PaperConfig, R50FConfig};
pub use description::LayerDescription;
pub(crate) use half_precision::Half;
pub use layer_table::layer_table;
pub use maps::{NetworkMaps, OUTSIDE};
pub use paper::PaperNetwork;
pub use r50f::R50FNetwork;
pub use reading::{images_to_tensor, pictures_to_tensor};
pub use weight_array::WeightArray;
