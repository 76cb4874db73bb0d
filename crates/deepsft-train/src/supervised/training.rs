//! Training step 1 (paper, section 4): all blocks, supervised, on synthetic frames made on the fly or read from data sets.

use super::batch_part::BatchShare;
use super::fingerprint::{difference, fingerprint};
use crate::TrainError;
use crate::config::TrainConfig;
use crate::data::{Loader, SampleSource, Targets};
use crate::device::{Step, Stepper, WeightAverage};
use crate::run::{Checkpoint, CheckpointFolder, CurvePoint, Progress};
use burn::module::Module;
use burn::tensor::Device;
use deepsft::{Network, NetworkConfig};
use deepsft_geometry::metrics::{FrameMetrics, Summary, frame_metrics};
use deepsft_synth::Sample;
use std::sync::Arc;
use std::time::Instant;

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
    if state.curve.is_empty() {
        // What the figures to come are to be better than.
        let watched = watch(&average.apply(network.valid()), &validation, device)?;
        let point = curve_point(&state, f64::NAN, config.schedule.learning_rate(0, 0.0), &watched);
        state.curve.push(point);
        report(Progress::Evaluated(point));
    }
    let mut loader = Loader::start(source, targets, config.seed, epoch_samples, config.workers);
    let mut asked_samples = state.samples;
    let (mut loss_sum, mut loss_count) = (0.0, 0_u64);
    let mut last_evaluation = state.seconds;
    let clock = Instant::now();
    let before = state.seconds;
    let mut paused = 0.0;
    loop {
        let share = config.budget.progress(state.seconds, state.samples);
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
            |network: &Network, share: BatchShare, number: usize| share.loss(network, &devices[number], dtype);
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

/// Metrics of a bare network on each sample that shows the template: what a training watches.
fn watch(network: &Network, samples: &[Sample], device: &Device) -> Result<Vec<FrameMetrics>, TrainError> {
    let [width, height] = network.config().template_size_mm;
    let mut frames = Vec::new();
    for sample in samples.iter().filter(|s| s.has_template) {
        for maps in pollster::block_on(network.infer(&[&sample.image], device))? {
            frames.push(frame_metrics(
                &maps,
                &sample.truth,
                &sample.camera,
                [width, height].into(),
            )?);
        }
    }
    Ok(frames)
}
