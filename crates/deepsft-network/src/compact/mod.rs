//! The compact DeepSfT network, see [`CompactNetwork`].

mod bins;
mod cells;
mod compact_network;
mod descriptor_network;
mod main_block;
mod planar;
mod refinement;
mod residual_block;

pub use bins::cross_entropy;
pub use cells::{INPUT_MULTIPLE, PIXELS_PER_CELL};
pub use compact_network::{CompactNetwork, NetworkOutput};
pub use descriptor_network::DescriptorNetwork;
