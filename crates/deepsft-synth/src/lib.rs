//! Synthetic training data for Shape-from-Template: quasi-isometric deformations, poses, a software
//! renderer with camera effects, and the data sets made of them. Native only.
//!
//! Everything is a pure function of (template, configuration, seed, index).

#![cfg_attr(test, allow(clippy::unwrap_used, clippy::expect_used, clippy::panic))]

mod artwork;
mod atlas;
mod background;
mod bars;
mod bend;
mod clip;
mod clip_story;
mod cloth;
mod color;
mod config;
mod dataset;
mod deformation;
mod disturbance;
mod error;
mod figure;
mod frame;
mod hand;
mod handles;
mod handling;
mod isometry;
mod noise;
mod occluder;
mod paper_protocol;
mod partial_view;
mod passing;
mod photometry;
mod pose;
mod poster;
mod recording;
mod relaxation;
mod sampling;
mod scene;
mod shading;
mod shape;
mod sheet;
mod silhouette;
mod synthesizer;
mod texture;
mod toy;
mod volumic;
mod xpbd;

pub use atlas::pack_rectangles;
pub use clip::{ClipConfig, ClipMotion, FIRST_CLIP_SEED};
pub use clip_story::{ClipEvent, ClipLength, ClipStory};
pub use config::{EffectsConfig, LightingConfig, OccluderKind, PhotographUse, SynthConfig};
pub use dataset::describe_dataset;
pub use deepsft_formats::{
    DatasetDescription, EdgeLengthChange, EdgeLengthHistogram, EdgeLengthSummary, EncodedSample, HandleShapeCounts,
    IndexedShards, Sample, SampleRecord, ShardReader, ShardWriter, encode_depth_png, encode_jpeg, encode_mask_png,
    write_shard,
};
pub use deformation::{DeformationConfig, DeformationFamily, deform};
pub use disturbance::{Cover, covered, disturbed_maps, faded};
pub use error::SynthError;
pub use handles::{HandleConfig, HandleDeformation, HandleShape};
pub use handling::ClothConfig;
pub use isometry::edge_length_change;
pub use partial_view::PartialView;
pub use pose::{PoseConfig, UniformPose, sample_pose, share_in_view};
pub use poster::{
    POSTER_HEIGHT_MM, POSTER_MARGIN_MM, POSTER_PRINT_PIXELS_PER_MM, POSTER_TEXTURE_PIXELS_PER_MM, POSTER_WIDTH_MM,
    poster_a4_pdf, poster_a4_picture, poster_a4_picture_at,
};
pub use recording::{
    ASSOCIATIONS_FILE, CAMERA_FILE, DEPTH_FOLDER, DepthAlignment, DepthNoise, MASK_FOLDER, PrintResponse, RGB_FOLDER,
    RecordedFrame, Recording, RecordingSimulator, RgbdSensor, SeenDepth, SimulatedFrame, SimulationConfig, Take,
};
pub use scene::Scene;
pub use synthesizer::Synthesizer;
pub use toy::toy_template;
pub use volumic::{RodBend, capsule};
