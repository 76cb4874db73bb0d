//! The paper's network and R50F: a plan from the image to the pixels' depths and registration.

mod executor;
#[cfg(feature = "webgpu")]
mod gpu;
mod network;
mod output;

pub(crate) use executor::ResidualExecutor;
#[cfg(feature = "webgpu")]
pub(crate) use gpu::ResidualGpuExecutor;
pub(crate) use network::ResidualPlan;
