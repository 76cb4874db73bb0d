//! Descriptions of networks: architecture, template, camera and range of depths.

mod architecture;
mod depth_range;
mod network_config;

pub use architecture::{Architecture, CompactConfig, PaperConfig, R50FConfig};
pub use depth_range::DepthRange;
pub use network_config::NetworkConfig;
