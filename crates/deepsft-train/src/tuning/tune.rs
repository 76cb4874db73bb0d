//! Training steps 2 and 3 (paper, section 4): one refinement block, on a recording, everything else frozen.

use super::device_loss::{Site, shares};
use super::fingerprint::fingerprint;
use super::recorded_frames::{RefinementData, RefinementStep};
use super::recording_metrics::{MeanMedian, RecordingFigures};
use super::training_frame::TrainingFrame;
use crate::TrainError;
use crate::config::{RefinementSteps, TrainConfig};
use crate::device::{Step, Stepper, WeightAverage};
use crate::loss::Light;
use crate::run::{Checkpoint, CheckpointFolder, CurvePoint, Progress};
use burn::module::Module;
use burn::store::ModuleRecord;
use burn::tensor::{Bytes, Device};
use deepsft::Network;
use rand::SeedableRng;
use rand::seq::SliceRandom;
use rand_pcg::Pcg64Mcg;
use std::time::Instant;

/// A refined network.
pub struct Refined {
    /// On the plain device; all weights but those of the step's block are bit for bit what they were.
    pub network: Network,
    /// Steps, epochs' figures.
    pub state: Checkpoint,
    /// How the network did on the held-out frames before.
    pub before: RecordingFigures,
    /// How it does after.
    pub after: RecordingFigures,
}

/// Trains the block of `step` of `network`, a folded one as bundles hold, on the plain `device` (differentiation is switched on here)
/// and [`TrainConfig::more_devices`], and reports through
/// `report`. After every epoch the held-out frames are measured and a checkpoint is saved, from which a training that
/// was stopped goes on exactly as it would have.
///
/// # Errors
/// [`TrainError`] for a checkpoint that cannot be read, written or continued, a loss that is no longer finite, or a
/// device that fails.
pub fn refine(
    network: &Network,
    step: RefinementStep,
    data: RefinementData<'_>,
    config: &TrainConfig,
    device: &Device,
    mut report: impl FnMut(Progress),
) -> Result<Refined, TrainError> {
    let frames = data.frames;
    let steps = match step {
        RefinementStep::Depth => config.depth_steps,
        RefinementStep::Registration => config.registration_steps,
    };
    let mut stepper = Stepper::new(device, &config.more_devices, config.precision)?;
    let differentiable = device.clone().autodiff();
    let measure = |network: &Network| RecordingFigures::measure(network, data, device);
    let network = &network.clone().fork(device);
    let before = measure(network)?;
    let make_network =
        || -> Result<Network, TrainError> { Ok(copy_of(network, &differentiable)?.train_only(&[step.block()])) };
    let mut trained = make_network()?;
    let mut optimizer = steps.optimizer.init();
    let mut average = WeightAverage::new(&trained, steps.average_decay);
    let dtype = stepper.dtype();
    let texture = match config.photo_consistency.light {
        Light::Recorded => data.texture_as_recorded(),
        Light::Ignored | Light::Fitted => data.template.texture().clone(),
    };
    let sites: Vec<Site> = (stepper.devices().iter())
        .map(|device| Site::new(&texture, device, dtype))
        .collect();
    let folder = CheckpointFolder::new(&config.checkpoint);
    let fingerprint = fingerprint(network, step, &data, config);
    let mut state = Checkpoint {
        fingerprint: fingerprint.clone(),
        seed: config.seed,
        ..Checkpoint::default()
    };
    if config.resume
        && let Some(saved) = folder.load(make_network, steps.optimizer.init(), &fingerprint, config.seed)?
    {
        let averaged = saved.average.as_ref().unwrap_or(&saved.network);
        average = WeightAverage::resume(averaged, steps.average_decay, saved.state.step);
        (state, trained, optimizer) = (saved.state, saved.network, saved.optimizer);
        stepper.resume(state.loss_scale);
        report(Progress::Resumed {
            samples: state.samples,
            seconds: state.seconds,
        });
    }
    if state.curve.is_empty() {
        state.curve.push(curve_point(&state, f64::NAN, &before, steps));
    }
    let total = steps.epochs * frames.training.len() as u64;
    let mut after = before;
    while state.samples < total {
        let epoch = state.samples / frames.training.len() as u64;
        let (mut sum, mut count) = (0.0, 0_u64);
        for batch in order(frames.training.len(), config.seed, epoch).chunks(steps.batch.max(1)) {
            let clock = Instant::now();
            let batch: Vec<&TrainingFrame> = batch.iter().map(|&index| &frames.training[index]).collect();
            let Step { network, loss, made } = stepper.step(
                trained,
                &mut optimizer,
                steps.learning_rate.at(state.step),
                shares(step, &batch, sites.len(), config),
                state.samples,
                |network, share, number| Ok(sites[number].loss(network, step, &share, config)),
            )?;
            trained = network;
            if made {
                average.update(&trained);
                state.step += 1;
            }
            state.samples += batch.len() as u64;
            state.seconds += clock.elapsed().as_secs_f64();
            if loss.is_finite() {
                (sum, count) = (sum + loss, count + 1);
            }
            if let (false, Some(scale)) = (made, stepper.scale()) {
                let samples = state.samples;
                report(Progress::Skipped { samples, scale });
                continue;
            }
            report(Progress::Step {
                share: state.samples as f64 / total as f64,
                samples: state.samples,
                seconds: state.seconds,
                loss,
            });
        }
        let averaged = average.apply(trained.valid());
        after = measure(&averaged)?;
        // Not a number where nothing was summed.
        let point = curve_point(&state, sum / count as f64, &after, steps);
        state.curve.push(point);
        state.loss_scale = stepper.scale();
        let averaged = (steps.average_decay > 0.0).then_some(&averaged);
        folder.save(&state, &trained.valid(), averaged, &optimizer)?;
        report(Progress::Evaluated(point));
    }
    let refined = average.apply(trained.valid());
    if state.samples > 0 && after == before {
        // Everything came from the checkpoint.
        after = measure(&refined)?;
    }
    Ok(Refined {
        network: refined,
        state,
        before,
        after,
    })
}

/// The frames of an epoch in their order, a function of seed and epoch.
fn order(frames: usize, seed: u64, epoch: u64) -> Vec<usize> {
    let mut order: Vec<usize> = (0..frames).collect();
    let mut rng = Pcg64Mcg::seed_from_u64(seed ^ (epoch + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15));
    order.shuffle(&mut rng);
    order
}

/// A network of its own with the same weights, for training on `device`. The weights of bundles are folded, and so are
/// the copy's.
fn copy_of(network: &Network, device: &Device) -> Result<Network, TrainError> {
    let failure = |reason: String| deepsft::DeepSftError::Execution { reason };
    let bytes = network
        .clone()
        .into_record()
        .into_bytes()
        .map_err(|e| failure(e.to_string()))?;
    let record = ModuleRecord::from_bytes(Bytes::from_bytes_vec(bytes.to_vec())).map_err(|e| failure(e.to_string()))?;
    let fresh = network.config().init(device).fold();
    Ok(fresh.try_load_record(record).map_err(|e| failure(e.to_string()))?)
}

fn curve_point(state: &Checkpoint, loss: f64, figures: &RecordingFigures, steps: RefinementSteps) -> CurvePoint {
    let median = |figure: Option<MeanMedian>| figure.map(|f| f.median);
    CurvePoint {
        samples: state.samples,
        seconds: state.seconds,
        loss,
        learning_rate: steps.learning_rate.at(state.step),
        registration_rmse_px: median(figures.registration_rmse_px),
        // Against the truth where there is one, else against the sensor.
        depth_rmse_mm: median(figures.depth_rmse_mm.or(figures.measured_depth_rmse_mm)),
        mask_iou: None,
        photometric_error: median(figures.photometric_error),
    }
}
