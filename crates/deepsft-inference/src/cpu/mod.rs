//! Plans on the processor.

mod convolution;
mod cpu_plan;
mod dense;
mod direct;
pub(crate) mod gemm;
mod layer_spec;
pub(crate) mod layout;
mod pool;
mod team;
mod winograd;

pub use cpu_plan::CpuPlan;
pub use team::available_threads;
pub(crate) use team::{Chunks, MAX_THREADS, Partition, in_parallel, with_team};
#[cfg(feature = "webgpu")]
pub(crate) use winograd::{POINTS, READ, TILE, filter_transform};
pub use winograd::{winograd_input_transform, winograd_output_transform};
