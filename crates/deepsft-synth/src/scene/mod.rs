//! Synthetic samples: the template in a random shape, pose and scene.

mod artwork;
mod background;
mod composition;
mod config;
mod ingredients;
pub(crate) mod occluder;
mod paper_protocol;
mod pose;
mod sample;
mod synthesizer;

pub(crate) use composition::Moment;
pub use composition::Scene;
pub use config::{PhotographUse, SynthConfig};
pub use occluder::OccluderKind;
pub use pose::{PoseConfig, UniformPose, sample_pose, share_in_view};
pub use sample::Sample;
pub use synthesizer::Synthesizer;
