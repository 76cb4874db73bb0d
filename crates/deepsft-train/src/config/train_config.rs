//! All settings of the three training steps, with the paper's values and ours.

use super::optimizer::{LearningRate, Optimizer};
use super::schedule::Schedule;
use super::tuning_step::TuningStep;
use crate::loss::{DepthLoss, Light, PhotoConsistencyLoss, Residual};
use serde::Serialize;
use std::path::PathBuf;

/// When step 1 ends.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum Budget {
    /// After this many seconds of training (of all its runs together).
    Seconds(f64),
    /// After this many samples. Deterministic on the CPU.
    Samples(u64),
}

impl Budget {
    /// The paper's 40 epochs of a set of so many samples to train on.
    pub fn paper_epochs(samples: u64) -> Self {
        Self::Samples(PAPER_EPOCHS.saturating_mul(samples))
    }

    /// The fraction of it that is spent after so much.
    pub(crate) fn progress(&self, spent_seconds: f64, seen_samples: u64) -> f64 {
        match *self {
            Self::Seconds(seconds) => spent_seconds / seconds.max(f64::MIN_POSITIVE),
            Self::Samples(samples) => seen_samples as f64 / samples.max(1) as f64,
        }
    }
}

/// How to train.
///
/// The default is ours, as `deepsft train` has it.
///
/// | | the paper ([`TrainConfig::paper`]) | ours ([`TrainConfig::ours`]) |
/// |---|---|---|
/// | step 1 | Adam 1e-3, betas 0.9, batches of 7 whole frames, 40 epochs of 47,000 | AdamW with clipping, warm-up and cosine from 2e-3, windows before frames, averaged weights, ever new samples where they are made on the fly |
/// | step 2 | SGD 1e-5, batches of 7, 10 epochs | AdamW 1e-4, averaged weights |
/// | step 3 | SGD 1e-5 with momentum and decay 1e-9, batches of 6, 10 epochs, Cauchy c = 4 of the squared difference | AdamW from 1e-3, falling, averaged weights, c = 60 of the difference, the template in the camera's colours |
///
/// lambda = 1e-9 and mu = 0.5 are the same in both. Both divide the losses of steps 2 and 3 by the number of pixels that
/// count. The paper prints sums, and says neither what its program divides by nor in which unit its depths are; both together
/// are one factor on the learning rate of step 2. With plain sums its rates diverge on the compact network (step 2: depth 21
/// to 642 mm in an epoch of 90 frames; step 3: an infinite loss after 24 frames). With means over pixels step 3 learns at
/// 1e-5, and step 2 does so with depths in decimetres; with depths in metres it hardly moves (24.14 to 24.11 mm in two epochs
/// of 90 frames). So these are our reading of the paper in [`TrainConfig::paper`]. Step 1's loss goes by the network in both:
/// the paper's own and R50F learn by the paper's, divided by the number of pixels too, the
/// compact one by ours, on cells and bins. Which images step 1 sees is no part of it: see
/// [`deepsft_synth::SynthConfig::paper`].
#[derive(Clone, Debug)]
pub struct TrainConfig {
    /// Seed of weights, data and their order.
    pub seed: u64,
    /// Folder of the checkpoint.
    pub checkpoint: PathBuf,
    /// Go on from the checkpoint if there is one.
    pub resume: bool,
    /// Step 1: folder of `weights.bpk` whose trunk the network begins with ([`deepsft_network::Network::with_trunk`]). It is of
    /// the network that describes any picture, or a model bundle. `None` for random weights. A training that is resumed was
    /// begun already; it must name the same weights.
    pub from: Option<PathBuf>,
    /// Step 1: when to end.
    pub budget: Budget,
    /// Step 1: seed of the held-out frames that are made on the fly; never trained on.
    pub held_out_seed: u64,
    /// Step 1: held-out frames; of a data set at most a tenth, its end.
    pub held_out_frames: u64,
    /// Frames that the rule for "found" and the accuracy on the bundle's card are measured on.
    pub accuracy_frames: u64,
    /// Step 1: seconds between two evaluations, each of which saves a checkpoint.
    pub evaluate_every: f64,
    /// Step 1: optimiser.
    pub optimizer: Optimizer,
    /// Step 1: learning rate and windows.
    pub schedule: Schedule,
    /// Step 1: decay per iteration of the average of the weights; 0 for the weights themselves.
    pub average_decay: f64,
    /// Step 1: samples of an epoch, after which the same come again; `None` for ever new ones. Of a data set it is always
    /// all that there is to train on.
    pub epoch_samples: Option<u64>,
    /// Step 1: threads that make or read samples.
    pub workers: usize,
    /// Steps 2 and 3: fraction of the recording, its end, that is not trained on. Our choice: the paper tests on new videos,
    /// with other viewpoints and manipulations. Measure on a recording of another place for that.
    pub held_out_fraction: f64,
    /// Step 2: epochs, batches, optimiser.
    pub depth_tuning: TuningSettings,
    /// Step 2: loss.
    pub depth_loss: DepthLoss,
    /// Step 3: epochs, batches, optimiser.
    pub registration_tuning: TuningSettings,
    /// Step 3: loss.
    pub photo_consistency: PhotoConsistencyLoss,
}

/// How a refinement block is trained on a recording.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct TuningSettings {
    /// Times that every frame is seen.
    pub epochs: u64,
    /// Frames per batch.
    pub batch: usize,
    /// Optimiser.
    pub optimizer: Optimizer,
    /// Learning rate.
    pub learning_rate: LearningRate,
    /// Decay per iteration of the average of the weights; 0 for the weights themselves. The average is what is measured and
    /// kept.
    pub average_decay: f64,
}

/// Samples of the paper's training sets, and its epochs.
const PAPER_SAMPLES: u64 = 47_000;
const PAPER_EPOCHS: u64 = 40;

/// Our reading of the unit of depth in the paper's step 2, see [`TrainConfig`].
const PAPER_DEPTH_UNIT_MM: f64 = 100.0;

impl TrainConfig {
    /// How the block of a step on a recording is trained.
    pub(crate) fn tuning(&self, step: TuningStep) -> TuningSettings {
        match step {
            TuningStep::Depth => self.depth_tuning,
            TuningStep::Registration => self.registration_tuning,
        }
    }

    /// The paper's values (section 4), with our reading of what it leaves open.
    pub fn paper() -> Self {
        let sgd = |momentum, decay, batch| TuningSettings {
            epochs: 10,
            batch,
            optimizer: Optimizer::Sgd { momentum },
            learning_rate: LearningRate { initial: 1e-5, decay },
            average_decay: 0.0,
        };
        Self {
            budget: Budget::paper_epochs(PAPER_SAMPLES),
            epoch_samples: Some(PAPER_SAMPLES),
            optimizer: Optimizer::Adam { betas: [0.9, 0.9] },
            schedule: Schedule::constant(1e-3, 7),
            average_decay: 0.0,
            depth_tuning: sgd(0.0, 0.0, 7),
            depth_loss: DepthLoss {
                total_variation: 1e-9,
                unit_mm: Some(PAPER_DEPTH_UNIT_MM),
            },
            registration_tuning: sgd(0.9, 1e-9, 6),
            photo_consistency: PhotoConsistencyLoss {
                cauchy_scale: 4.0,
                residual: Residual::Squared,
                half_size: 0.5,
                total_variation: 1e-9,
                light: Light::Ignored,
            },
            ..Self::ours()
        }
    }

    /// What was measured to work on the compact network in the time of a CPU: beyond the paper.
    pub fn ours() -> Self {
        let adam_w = Optimizer::AdamW {
            weight_decay: 1e-4,
            clip: 1.0,
        };
        let steps = |initial, decay, batch| TuningSettings {
            epochs: 10,
            batch,
            optimizer: adam_w,
            learning_rate: LearningRate { initial, decay },
            average_decay: 0.98,
        };
        Self {
            seed: 1,
            checkpoint: PathBuf::from("runs/checkpoint"),
            resume: false,
            from: None,
            budget: Budget::Seconds(3600.0),
            held_out_seed: 0x7e57,
            held_out_frames: 48,
            accuracy_frames: 160,
            evaluate_every: 120.0,
            optimizer: adam_w,
            schedule: Schedule::default(),
            average_decay: 0.998,
            epoch_samples: None,
            workers: 2,
            held_out_fraction: 0.25,
            depth_tuning: steps(1e-4, 0.0, 7),
            depth_loss: DepthLoss {
                total_variation: 1e-9,
                unit_mm: None,
            },
            registration_tuning: steps(1e-3, 0.02, 6),
            photo_consistency: PhotoConsistencyLoss {
                cauchy_scale: 60.0,
                residual: Residual::Plain,
                half_size: 0.5,
                total_variation: 1e-9,
                light: Light::Recorded,
            },
        }
    }
}

impl Default for TrainConfig {
    fn default() -> Self {
        Self::ours()
    }
}
