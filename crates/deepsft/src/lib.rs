//! Shape-from-Template from one image or video: network, model bundle, canonical warp, estimator, and [`video`], which runs
//! the network beside the tracker.
//!
//! The same code runs natively and in WebAssembly. Nothing here opens a file, reads a clock or
//! fetches: bundles and pictures come as bytes, devices are started by [`start_device`].

#![cfg_attr(test, allow(clippy::unwrap_used, clippy::expect_used, clippy::panic))]

mod bundle;
mod device;
mod device_kind;
mod error;
mod estimator;
mod finding;
mod network;
mod photo_consistency;
pub mod video;

pub use bundle::{Accuracy, FoundRule, MODEL_FILE, ModelBundle, ModelCard, Provenance, WEIGHTS_FILE};
pub use deepsft_finding as features;
pub use deepsft_formats as formats;
pub use deepsft_formats::{
    FormatError, LONGEST_SIDE, TEMPLATE_FILE, TemplateFile, camera_to_json, decode_picture, encode_png, mesh_from_obj,
    mesh_to_obj, parse_camera, template_to_files,
};
pub use deepsft_geometry as geometry;
pub use deepsft_inference::{CompactExecutor, PlanError, Stage};
pub use device::{DeviceDescription, start_device, start_devices};
pub use device_kind::DeviceKind;
pub use error::DeepSftError;
pub use estimator::{Estimate, Estimator, Judgement};
pub use finding::{
    DescriptorFinder, Finder, FinderKind, SharedDescriptorNetwork, Sighting, Target, TargetEstimate, TargetFinder,
    View, is_found,
};
pub use network::{
    Architecture, Block, CompactConfig, CompactNetwork, DESCRIPTOR_LENGTH, DepthRange, DescriptorNetwork,
    INPUT_MULTIPLE, LayerDescription, Network, NetworkConfig, NetworkMaps, NetworkOutput, OUTSIDE, PIXELS_PER_CELL,
    PaperConfig, PaperNetwork, R50FConfig, R50FNetwork, SEAM_JUMP, WeightArray, cross_entropy, images_to_tensor,
    layer_table, pictures_to_tensor,
};
pub use photo_consistency::TemplateLuminance;
