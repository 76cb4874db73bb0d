//! Synthetic samples: the template in a random shape, pose and scene.

mod artwork;
mod background;
mod composition;
mod config;
pub(crate) mod occluder;
mod paper_protocol;
mod photographs;
pub(crate) mod pose;
mod samples;
mod synthesizer;

pub use artwork::artwork;
pub(crate) use composition::Moment;
pub use composition::Scene;
pub use config::{PhotographUse, SynthConfig};
pub use occluder::OccluderKind;
pub use pose::PoseConfig;
pub use synthesizer::Synthesizer;
