//! Synthetic training data for Shape-from-Template: quasi-isometric deformations, poses, a software
//! renderer with camera effects, and the data sets made of them. Native only.
//!
//! Everything is a pure function of (template, configuration, seed, index).

#![cfg_attr(test, allow(clippy::unwrap_used, clippy::expect_used, clippy::panic))]

mod atlas;
mod clip;
mod dataset;
mod dataset_description;
mod deform;
mod error;
mod fingerprint;
mod random;
mod recording;
mod render;
mod scene;
mod shard_index;
mod shard_reader;

pub use atlas::pack_rectangles;
pub use clip::{ClipConfig, ClipEvent, ClipLength, ClipMotion, ClipStory, FIRST_CLIP_SEED};
pub use dataset::{EncodedSample, SampleRecord, ShardWriter, write_shard};
pub use dataset_description::{DatasetDescription, EdgeLengthSummary, HandleShapeCounts};
pub use deform::{
    ClothConfig, DeformationConfig, DeformationFamily, EdgeLengthChange, EdgeLengthHistogram, HandleConfig,
    HandleDeformation, HandleShape, RodBend, capsule, deform, edge_length_change,
};
pub use error::SynthError;
pub use recording::{
    ASSOCIATIONS_FILE, CAMERA_FILE, DEPTH_FOLDER, DepthAlignment, DepthNoise, MASK_FOLDER, PrintResponse, RGB_FOLDER,
    RecordedFrame, Recording, RecordingSimulator, RgbdSensor, SeenDepth, SimulatedFrame, SimulationConfig, Take,
    encode_depth_png, encode_jpeg, encode_mask_png,
};
pub use render::{EffectsConfig, LightingConfig};
pub use scene::{
    Cover, OccluderKind, PartialView, PhotographUse, PoseConfig, Sample, Scene, SynthConfig, Synthesizer, UniformPose,
    covered, disturbed_maps, faded, sample_pose, share_in_view,
};
pub use shard_index::IndexedShards;
pub use shard_reader::ShardReader;

/// Hashes and smooth noise that depend on nothing but their arguments, for painting templates.
pub mod noise {
    pub use crate::random::mix;
    pub use crate::render::value_noise::{ValueNoise, floor};
}
