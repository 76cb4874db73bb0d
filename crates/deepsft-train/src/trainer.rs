//! Training step 1 (paper, section 4): all blocks, supervised, on synthetic frames made on the fly or read from data sets.

use crate::TrainError;
use crate::average::WeightAverage;
use crate::checkpoint::{Checkpoint, CheckpointFolder, CurvePoint};
use crate::config::{Budget, TrainConfig};
use crate::evaluate::watch;
use crate::loader::{Loader, Targets, TrainingBatch};
use crate::loss::{step_one_loss, supervised_maps_loss};
use crate::precision::LossScale;
use crate::sample_source::SampleSource;
use crate::shares::{BatchShare, weighed};
use crate::step::{Step, Stepper};
use crate::step_one_fingerprint::{difference, fingerprint};
use burn::module::Module;
use burn::tensor::{Device, FloatDType, Tensor};
use deepsft::{Network, NetworkConfig};
use deepsft_geometry::metrics::{FrameMetrics, Summary};
use std::sync::Arc;
use std::time::Instant;

impl Budget {
    fn progress(&self, state: &Checkpoint) -> f64 {
        match *self {
            Self::Seconds(seconds) => state.seconds / seconds.max(f64::MIN_POSITIVE),
            Self::Samples(samples) => state.samples as f64 / samples.max(1) as f64,
        }
    }
}

/// What a training tells while it runs.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub enum Progress {
    /// A checkpoint was found and is continued.
    Resumed {
        /// Samples it had seen.
        samples: u64,
        /// Seconds it had trained.
        seconds: f64,
    },
    /// A step was made.
    Step {
        /// Share of the budget spent, 0..=1.
        share: f64,
        /// Samples seen.
        samples: u64,
        /// Seconds trained.
        seconds: f64,
        /// Loss of the step.
        loss: f64,
    },
    /// A step in half precision was not made: its gradients were not finite.
    Skipped {
        /// Samples seen.
        samples: u64,
        /// The scale after it, and the number of such steps.
        scale: LossScale,
    },
    /// The held-out set was evaluated and a checkpoint saved.
    Evaluated(CurvePoint),
}

/// A finished training.
pub struct Trained {
    /// The averaged network, on a plain device, folded for inference.
    pub network: Network,
    /// Samples, seconds and the curve.
    pub state: Checkpoint,
}

/// Trains a network of `network_config` on the samples of `source` (a [`Synthesizer`](deepsft_synth::Synthesizer), or
/// [`StoredSamples`](crate::StoredSamples), all of which are an epoch) and on `device` (a plain one; differentiation is
/// switched on here) and [`TrainConfig::more_devices`], and reports through `report`. The compact network learns cells and
/// bins of windows of frames (`config.loss`), the others the paper's loss on the maps of whole frames.
///
/// # Errors
/// [`TrainError`] for a checkpoint that cannot be read, written or continued, samples that are too few or cannot be read, a
/// loss that is no longer finite, a device that fails or does not compute in the precision asked for.
pub fn train<S: SampleSource + ?Sized + 'static>(
    source: &Arc<S>,
    network_config: &NetworkConfig,
    config: &TrainConfig,
    device: &Device,
    mut report: impl FnMut(Progress),
) -> Result<Trained, TrainError> {
    let targets = Targets::of(network_config);
    let mut stepper = Stepper::new(device, &config.more_devices, config.precision)?;
    let differentiable = device.clone().autodiff();
    device.seed(config.seed);
    let mut network = network_config.init(&differentiable);
    let mut optimizer = config.optimizer.init();
    let folder = CheckpointFolder::new(&config.checkpoint);
    let epoch_samples = source
        .training_samples(config.held_out_frames)?
        .or(config.epoch_samples);
    let fingerprint = fingerprint(&**source, network_config, config, epoch_samples);
    let mut state = Checkpoint {
        fingerprint: fingerprint.clone(),
        seed: config.seed,
        ..Checkpoint::default()
    };
    let mut average = WeightAverage::new(&network, config.average_decay);
    if config.resume
        && let Some((path, saved)) = folder.state()?
        && let Some(what) = difference(&saved.fingerprint, &fingerprint)
    {
        return Err(TrainError::CheckpointMismatch { what, path });
    }
    if config.resume
        && let Some(saved) = folder.load(
            || Ok(network_config.init(&differentiable)),
            config.optimizer.init(),
            &fingerprint,
            config.seed,
        )?
    {
        let averaged = saved.average.as_ref().unwrap_or(&saved.network);
        average = WeightAverage::resume(averaged, config.average_decay, saved.state.step);
        (network, optimizer, state) = (saved.network, saved.optimizer, saved.state);
        stepper.resume(state.loss_scale);
        report(Progress::Resumed {
            samples: state.samples,
            seconds: state.seconds,
        });
    }

    let validation = source.held_out(config.held_out_seed, config.held_out_frames)?;
    let mut loader = Loader::start(source, targets, config.seed, epoch_samples, config.workers);
    let mut asked_samples = state.samples;
    let (mut loss_sum, mut loss_count) = (0.0, 0_u64);
    let mut last_evaluation = state.seconds;
    let clock = Instant::now();
    let before = state.seconds;
    let mut paused = 0.0;
    loop {
        let share = config.budget.progress(&state);
        let finished = share >= 1.0;
        // A training that goes on from a checkpoint was measured there already.
        let measured = state.curve.last().is_some_and(|p| p.samples == state.samples);
        if !measured && (finished || state.seconds - last_evaluation >= config.evaluate_every) {
            let pause = Instant::now();
            let plain = average.apply(network.valid());
            let watched = watch(&plain, &validation, device)?;
            // Not a number where nothing was summed.
            let loss = loss_sum / loss_count as f64;
            let point = curve_point(&state, loss, config.schedule.learning_rate(state.step, share), &watched);
            state.curve.push(point);
            state.loss_scale = stepper.scale();
            folder.save(&state, &network.valid(), Some(&plain), &optimizer)?;
            report(Progress::Evaluated(point));
            (loss_sum, loss_count) = (0.0, 0);
            last_evaluation = state.seconds;
            paused += pause.elapsed().as_secs_f64();
        }
        if finished {
            break;
        }
        while loader.wanted() > 0 {
            let shape = match targets {
                Targets::Cells(_) => config.schedule.shape(share),
                Targets::Maps(_) => config.schedule.frames,
            };
            loader.ask(asked_samples, shape);
            asked_samples += shape.frames as u64;
        }
        let batch = loader.take()?;
        let frames = batch.frames() as u64;
        let shares = BatchShare::of(batch, stepper.devices().len(), &config.loss);
        let rate = config.schedule.learning_rate(state.step, share);
        let (devices, dtype) = (stepper.devices().to_vec(), stepper.dtype());
        let loss_of =
            |network: &Network, share: BatchShare, number: usize| share_loss(network, share, &devices[number], dtype);
        let step = stepper.step(network, &mut optimizer, rate, shares, state.samples, loss_of)?;
        let Step { loss, made, .. } = step;
        network = step.network;
        if made {
            average.update(&network);
            state.step += 1;
        }
        state.samples += frames;
        state.seconds = before + clock.elapsed().as_secs_f64() - paused;
        if loss.is_finite() {
            (loss_sum, loss_count) = (loss_sum + loss, loss_count + 1);
        }
        if let (false, Some(scale)) = (made, stepper.scale()) {
            let samples = state.samples;
            report(Progress::Skipped { samples, scale });
            continue;
        }
        report(Progress::Step {
            share,
            samples: state.samples,
            seconds: state.seconds,
            loss,
        });
    }
    let network = average.apply(network.valid()).fold();
    Ok(Trained { network, state })
}

/// What is minimised, [1], of a share of a batch: ours for the compact network, the paper's for those that say
/// full-resolution maps. The network sees the images in `dtype`, the loss is in single precision.
pub(crate) fn share_loss(
    network: &Network,
    share: BatchShare,
    device: &Device,
    dtype: FloatDType,
) -> Result<Tensor<1>, TrainError> {
    let BatchShare { batch, terms, weight } = share;
    let loss = match batch {
        TrainingBatch::Cells(batch) => {
            let compact = network.as_compact().ok_or_else(|| TrainError::Architecture {
                actual: network.config().architecture.name(),
                expected: "compact",
            })?;
            let tensors = batch.into_tensors(device);
            let output = compact.forward_windows(tensors.images.clone().cast(dtype), &tensors.corners);
            step_one_loss(output, &tensors, &terms).total
        }
        TrainingBatch::Maps(batch) => {
            let tensors = batch.into_tensors(device);
            let maps = network.forward_maps(tensors.images.cast(dtype));
            supervised_maps_loss(&maps, &tensors.depth, &tensors.registration).total
        }
    };
    Ok(weighed(loss, weight))
}

fn curve_point(state: &Checkpoint, loss: f64, learning_rate: f64, watched: &[FrameMetrics]) -> CurvePoint {
    let summary = |metric: fn(&FrameMetrics) -> Option<f64>| Summary::of(watched.iter().map(metric));
    let median = |metric| summary(metric).map(|s| s.median);
    CurvePoint {
        samples: state.samples,
        seconds: state.seconds,
        loss,
        learning_rate,
        registration_rmse_px: median(|m| m.registration_rmse_px),
        depth_rmse_mm: median(|m| m.depth_rmse_mm),
        mask_iou: summary(|m| m.mask_iou).map(|s| s.mean),
        photometric_error: None,
    }
}
