#![doc = include_str!("../README.md")]
//!
//! # Where to begin
//!
//! [`deepsft_inference::NetworkConfig`] says which architecture and how large, [`Network`] is any of them with its weights,
//! [`Network::forward_maps`] what training steps and tools need of it: the same maps from each. A finished network is
//! handed on as a [`deepsft_inference::FoldedNetwork`], which runs without burn.
#![cfg_attr(test, allow(clippy::unwrap_used, clippy::expect_used, clippy::panic))]

mod any_network;
mod block;
mod compact;
mod convolution;
mod convolution_layer;
mod description;
mod device;
mod error;
mod folding;
mod layer_table;
mod maps;
mod module;
mod paper;
mod r50f;
mod reading;
mod resampling;
mod resnet;
mod trunk;
mod weight_array;
mod weight_init;

pub use any_network::Network;
pub use block::Block;
/// Tensors and devices in this interface are those of this version of burn.
pub use burn;
pub use compact::{CompactNetwork, DescriptorNetwork, INPUT_MULTIPLE, NetworkOutput, PIXELS_PER_CELL, cross_entropy};
pub use description::{Cost, LayerDescription};
pub use device::start_device;
pub use error::NetworkError;
pub use layer_table::layer_table;
pub use maps::{NetworkMaps, OUTSIDE};
pub use paper::PaperNetwork;
pub use r50f::R50FNetwork;
pub use reading::{images_to_tensor, pictures_to_tensor};
