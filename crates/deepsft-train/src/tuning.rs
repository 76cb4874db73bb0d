//! Training steps 2 and 3 (paper, section 4): one refinement block, on a recording, everything else frozen.

mod device_loss;
mod fingerprint;
mod frame_part;
mod recorded_frames;
mod recording_metrics;
mod training_frame;
mod tune;

pub use fingerprint::set_aside_outdated;
pub use recorded_frames::{RecordedFrames, RefinementData, RefinementStep};
pub use recording_metrics::{MeanMedian, RecordingFigures};
pub use training_frame::TrainingFrame;
pub use tune::{Refined, refine};
