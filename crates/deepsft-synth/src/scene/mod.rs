//! Synthetic samples: the template in a random shape, pose and scene.

mod artwork;
mod background;
mod composition;
mod config;
mod disturbance;
mod ingredients;
pub(crate) mod occluder;
mod paper_protocol;
mod partial_view;
mod pose;
mod synthesizer;

pub(crate) use composition::Moment;
pub use composition::Scene;
pub use config::{PhotographUse, SynthConfig};
pub use disturbance::{Cover, covered, disturbed_maps, faded};
pub use occluder::OccluderKind;
pub use partial_view::PartialView;
pub use pose::{PoseConfig, UniformPose, fraction_in_view, sample_pose};
pub use synthesizer::Synthesizer;
