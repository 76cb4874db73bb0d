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

pub use descriptors::{DESCRIPTOR_LENGTH, DescriptorExecutor, DescriptorSimilarities};
pub(crate) use executor::CompactExecutor;
#[cfg(feature = "webgpu")]
pub(crate) use gpu::CompactGpuExecutor;
pub(crate) use network::CompactPlan;
