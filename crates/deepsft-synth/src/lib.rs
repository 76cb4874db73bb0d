#![doc = include_str!("../README.md")]
#![cfg_attr(test, allow(clippy::unwrap_used, clippy::expect_used, clippy::panic))]

mod camera_images;
mod canonical_truth;
mod clip;
mod dataset;
mod deform;
mod error;
mod in_order;
pub mod random;
mod recording;
mod render;
mod sample;
mod scene;

pub use camera_images::{encode_depth_png, encode_mask_png};
pub use canonical_truth::canonical_truth;
pub use clip::{
    CLIP_FILE, ClipDescription, ClipEvent, ClipFolder, ClipLength, ClipMotion, ClipStory, FIRST_CLIP_SEED,
    TRUTH_FOLDER, frame_name,
};
pub use dataset::{
    DATASET_FILE, DatasetDescription, DatasetFolder, DatasetPart, DatasetPlan, IndexedShards, UnfinishedDataset,
    dataset_parts, write_dataset,
};
pub use deepsft_formats::CAMERA_FILE;
pub use deform::DeformationConfig;
pub use error::SynthError;
pub use in_order::{clip_frames, in_order, samples};
/// The generators in this interface are those of this version of rand.
pub use rand;
pub use recording::{
    DEPTH_FOLDER, FramePairing, MASK_FOLDER, PrintResponse, RGB_FOLDER, RecordedFrame, Recording, RecordingImport,
    RecordingSimulator, RecordingSource, RgbdSensor, SimulatedFrame, Take, TruthSource,
};
pub use render::{EffectsConfig, LightingConfig};
pub use sample::Sample;
pub use scene::{OccluderKind, PhotographUse, PoseConfig, Scene, SynthConfig, Synthesizer};

/// Colours, smooth noise and artwork, for painting textures.
pub mod painting {
    pub use crate::render::{ValueNoise, floor, srgb8_from_linear};
    pub use crate::scene::artwork;
}

#[cfg(test)]
#[path = "../tests/unit/mod.rs"]
mod tests;
