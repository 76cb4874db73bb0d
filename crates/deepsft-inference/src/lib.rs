#![doc = include_str!("../README.md")]
//!
//! # From a network to a plan
//!
//! Training needs a tensor library that differentiates. A frame needs the shortest way through fixed arithmetic. A folded network
//! becomes a plan once, which lists the layers and the maps they read. Its filters are packed, every map gets its memory,
//! and then it runs without allocating. An [`Executor`] runs a network of any architecture; around the plan of the compact network it
//! computes coordinates from bins and depths from the registration.
//!
//! Several threads make a frame together. They are this crate's own, at most 8, and sleep between frames.
//!
//! This crate knows neither burn nor files nor training.
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
#[cfg(all(test, feature = "webgpu"))]
#[path = "../tests/inside/gpu.rs"]
mod gpu_tests;
mod plan;
mod residual;
mod stage;
mod weights;

pub use compact::{DESCRIPTOR_LENGTH, DescriptorExecutor, DescriptorSimilarities};
pub use config::{Architecture, CompactConfig, DepthRange, NetworkConfig, PaperConfig, R50FConfig};
pub use cpu::available_threads;
pub use device_kind::{DeviceDescription, DeviceKind, UnknownDevice};
pub use executor::Executor;
#[cfg(feature = "webgpu")]
pub use executor::GpuExecutor;
pub use folded::FoldedNetwork;
#[cfg(feature = "webgpu")]
pub use gpu::{Gpu, GpuError};
pub use plan::PlanError;
pub use stage::Stage;
pub use weights::{WeightArray, Weights};

/// Matrix products (GEMM) in the processor's vectors, and the transforms of Winograd's convolutions.
///
/// The convolutions of an [`Executor`](crate::Executor) are made of them, and so are those of `deepsft-network` in training.
pub mod gemm {
    pub use crate::cpu::gemm::{Epilogue, MatrixRows, Overwrite, PackedMatrix, multiply, vector_width};
    pub use crate::cpu::layout::{AlignedBuffer, odd_cache_lines, padded_channels, vector};
    pub use crate::cpu::{InputLines, LineTransform, OutputLines, both_ways, plus};
}
