//! Synthetic training data for Shape-from-Template: quasi-isometric deformations, poses, a software
//! renderer with camera effects, and the data sets made of them. Native only.
//!
//! Everything is a pure function of (template, configuration, seed, index).

#![cfg_attr(test, allow(clippy::unwrap_used, clippy::expect_used, clippy::panic))]

mod atlas;
mod clip;
mod dataset;
mod deform;
mod error;
mod fingerprint;
mod random;
mod recording;
mod render;
mod scene;

pub use atlas::pack_rectangles;
pub use clip::{ClipConfig, ClipEvent, ClipLength, ClipMotion, ClipStory, FIRST_CLIP_SEED};
pub use dataset::describe_dataset;
pub use deepsft_formats::{
    DatasetDescription, EdgeLengthChange, EdgeLengthHistogram, EdgeLengthSummary, EncodedSample, HandleShapeCounts,
    IndexedShards, Sample, SampleRecord, ShardReader, ShardWriter, encode_depth_png, encode_jpeg, encode_mask_png,
    write_shard,
};
pub use deform::{
    ClothConfig, ControlPointConfig, ControlPointDeformation, ControlPointShape, DeformationConfig, DeformationFamily,
    RodBend, capsule, deform, edge_length_change,
};
pub use error::SynthError;
pub use recording::{
    ASSOCIATIONS_FILE, CAMERA_FILE, DEPTH_FOLDER, DepthAlignment, DepthNoise, MASK_FOLDER, PrintResponse, RGB_FOLDER,
    RecordedFrame, Recording, RecordingSimulator, RgbdSensor, SeenDepth, SimulatedFrame, SimulationConfig, Take,
};
pub use render::{EffectsConfig, LightingConfig};
pub use scene::{
    Cover, OccluderKind, PartialView, PhotographUse, PoseConfig, Scene, SynthConfig, Synthesizer, UniformPose, covered,
    disturbed_maps, faded, fraction_in_view, sample_pose,
};

/// Hashes and smooth noise that depend on nothing but their arguments, for painting templates.
pub mod noise {
    pub use crate::random::mix;
    pub use crate::render::value_noise::{ValueNoise, floor};
}
