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

pub(crate) use cpu_plan::CpuPlan;
pub use team::available_threads;
pub(crate) use team::{Chunks, MAX_THREADS, in_parallel, with_team};
pub use winograd::{InputLines, LineTransform, OutputLines, both_ways, plus};
#[cfg(feature = "webgpu")]
pub(crate) use winograd::{POINTS, READ, TILE, filter_at_point};
