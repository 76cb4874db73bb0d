//! The compact network: its plan, and the arithmetic between its convolutions.

mod cell_maps;
mod cells;
mod depths;
mod descriptors;
mod executor;
#[cfg(feature = "webgpu")]
mod gpu;
mod network;
mod patches;
#[cfg(feature = "webgpu")]
mod shaders;

#[cfg(feature = "webgpu")]
pub(crate) use cell_maps::CellMaps;
pub use descriptors::{DESCRIPTOR_LENGTH, DescriptorExecutor, DescriptorSimilarities};
pub(crate) use executor::CompactFrame;
#[cfg(feature = "webgpu")]
pub(crate) use gpu::{compact_pipeline, logit};
pub(crate) use network::CompactPlan;
