//! The paper's network and R50F: a plan from the image to the pixels' depths and registration.

#[cfg(feature = "webgpu")]
mod gpu;
mod network;
mod output;

#[cfg(feature = "webgpu")]
pub(crate) use gpu::residual_pipeline;
pub(crate) use network::ResidualPlan;
pub(crate) use output::read;
