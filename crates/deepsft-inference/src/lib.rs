#![doc = include_str!("../README.md")]
//!
//! # From a network to a plan
//!
//! Training wants a tensor library that differentiates; a frame wants the shortest way through fixed arithmetic. Here a folded
//! network is taken to a [`Plan`] once: which convolution reads which maps. [`CpuPlan`] packs its filters as the kernels want
//! them, gives every map its memory, and then runs without allocating. An [`Executor`] runs a network of any architecture: for the
//! compact one it puts that network's own arithmetic around the plan (positions from bins, depths from the registration).
//!
//! Nothing here knows burn, files or training.
#![forbid(unsafe_code)]
#![cfg_attr(test, allow(clippy::unwrap_used, clippy::expect_used, clippy::panic))]

mod compact;
mod config;
mod cpu;
mod device_kind;
mod executor;
mod folded;
#[cfg(feature = "webgpu")]
mod gpu;
mod plan;
mod residual;
mod stage;
mod weights;

pub use compact::{DESCRIPTOR_LENGTH, DescriptorExecutor};
pub use config::{Architecture, CompactConfig, DepthRange, NetworkConfig, PaperConfig, R50FConfig};
pub use cpu::{CpuPlan, available_threads};
pub use device_kind::{DeviceDescription, DeviceKind, UnknownDevice};
pub use executor::Executor;
#[cfg(feature = "webgpu")]
pub use executor::GpuExecutor;
pub use folded::FoldedNetwork;
#[cfg(feature = "webgpu")]
pub use gpu::{Gpu, GpuError, GpuPlan};
pub use plan::{Added, Convolution, Dense, Filters, Input, MapId, MapShape, Plan, PlanError, Pool};
pub use stage::Stage;
pub use weights::{WeightArray, Weights};

// What our other crates and tests share; no stable interface.
#[cfg(feature = "webgpu")]
#[doc(hidden)]
pub use compact::CompactGpuExecutor;
#[doc(hidden)]
pub use compact::{CompactExecutor, Similarities};
#[doc(hidden)]
pub use config::{ENCODED, ENCODED_WIDTH, MAP_VALUES, MAPS};
#[doc(hidden)]
pub use residual::ResidualExecutor;
#[cfg(feature = "webgpu")]
#[doc(hidden)]
pub use residual::ResidualGpuExecutor;

/// Products of matrices in the processor's vectors: what the convolutions of [`CpuPlan`] are made of, and those of training.
#[doc(hidden)]
pub mod product {
    pub use crate::cpu::{
        Buffer, Lanes, Packed, Products, Rows, Sink, multiply, odd_lines, padded, to_places, to_points,
    };
}
