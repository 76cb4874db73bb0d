#![doc = include_str!("../README.md")]
//!
//! # Where to begin
//!
//! A [`Target`] is what is looked for, a [`TargetFinder`] looks for it in images, and a [`session`] runs finders beside trackers.
//! A [`ModelBundle`] is a trained network with its template; [`Estimator`] runs it alone. Devices are started by
//! [`start_device`]. Nothing here reads a clock or fetches.

#![cfg_attr(test, allow(clippy::unwrap_used, clippy::expect_used, clippy::panic))]

mod bundle;
mod device;
mod error;
mod estimate;
mod estimator;
mod finding;
mod photo_consistency;
pub mod session;
mod weights_file;

pub use bundle::{Accuracy, FoundRule, MODEL_FILE, ModelBundle, ModelCard, Provenance, WEIGHTS_FILE};
pub use deepsft_finding as features;
pub use deepsft_formats as formats;
pub use deepsft_formats::{
    FormatError, MAX_PICTURE_SIDE_PX, TEMPLATE_FILE, TemplateFile, camera_from_json, camera_to_json, decode_picture,
    encode_png, mesh_from_obj, mesh_to_obj, template_to_files,
};
pub use deepsft_geometry as geometry;
#[cfg(feature = "webgpu")]
pub use deepsft_inference::Gpu;
pub use deepsft_inference::{
    Architecture, CompactConfig, DepthRange, DeviceDescription, DeviceKind, Executor, FoldedNetwork, NetworkConfig,
    PaperConfig, PlanError, R50FConfig, Stage, UnknownDevice, WeightArray, Weights,
};
pub use device::{Device, start_device};
pub use error::DeepSftError;
pub use estimate::{Estimate, Judgement};
pub use estimator::{EstimateTimes, Estimator};
pub use finding::{
    ALIKE, CameraOrigin, DescriptorFinder, Finder, FinderKind, SharedDescriptorNetwork, Sighting, Target, TargetFinder,
    View,
};
pub use weights_file::{weights_from_burnpack, weights_to_burnpack};
