//! Descriptions of networks: architecture, template, camera and range of depths.

mod compact_config;
mod depth_range;
mod limits;
mod network_config;
mod paper_config;
mod r50f_config;

pub use compact_config::CompactConfig;
pub use depth_range::DepthRange;
pub use network_config::{Architecture, NetworkConfig};
pub use paper_config::PaperConfig;
pub use r50f_config::R50FConfig;
