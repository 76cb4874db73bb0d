//! Plans on a GPU, by WebGPU in a browser and by Vulkan, Metal or Direct3D 12 natively.

mod convolution;
mod device;
mod frames;
mod plan;
pub(crate) mod shader;
mod simple;
mod winograd;

pub use device::{Gpu, GpuError};
pub(crate) use frames::FramePipeline;
pub(crate) use plan::GpuPlan;
pub(crate) use shader::Kernel;
