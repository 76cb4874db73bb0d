//! Training steps 2 and 3: one refinement block, on a recording, everything else frozen.

use super::fingerprint::fingerprint;
use super::recorded_frames::TuningSet;
use super::recording_metrics::{MeanMedian, RecordingMetrics};
use super::training_frame::{TrainingFrame, numbers, pixels};
use crate::config::{TrainConfig, TuningSettings, TuningStep};
use crate::error::TrainError;
use crate::loss::{Light, TexturePyramid, registration_of_positions};
use crate::run::{Checkpoint, CurvePoint, Finished, Progress, RunSettings, TrainingStep, run};
use burn::module::Module;
use burn::tensor::{Device, Tensor};
use deepsft_geometry::{Picture, RestSurface};
use deepsft_network::{Network, NetworkMaps, pictures_to_tensor};
use rand::SeedableRng;
use rand::seq::SliceRandom;
use rand_pcg::Pcg64Mcg;

/// A tuned network.
#[derive(Debug)]
#[non_exhaustive]
pub struct Tuned {
    /// On the plain device; all weights but those of the step's block are bit for bit what they were.
    pub network: Network,
    /// Samples, seconds and the curve.
    pub state: Checkpoint,
    /// The errors on the held-out frames before.
    pub before: RecordingMetrics,
    /// The errors after.
    pub after: RecordingMetrics,
}

/// Trains the block of `step` of `network`, a folded one as bundles hold: steps 2 and 3. `device` is a plain one;
/// differentiation is switched on here. After every epoch the held-out frames are measured and a checkpoint is saved, from
/// which a training that was stopped goes on exactly as it would have.
///
/// # Errors
/// [`TrainError`] for a checkpoint that cannot be read, written or continued, a loss or weights that are no longer finite, or
/// a device that fails.
pub fn tune(
    network: &Network,
    step: TuningStep,
    set: TuningSet<'_>,
    config: &TrainConfig,
    device: &Device,
    report: impl FnMut(Progress),
) -> Result<Tuned, TrainError> {
    let start = network.clone().fork(device);
    let texture = match config.photo_consistency.light {
        Light::Recorded => set.texture_as_recorded(),
        Light::Ignored => set.template.texture().clone(),
    };
    let differentiable = device.clone().autodiff();
    let tuning = Tuning {
        step,
        settings: config.tuning(step),
        set,
        config,
        device,
        texture: TexturePyramid::new(&texture, &differentiable),
        surface: start.config().rest_surface(set.template),
        differentiable,
        start: &start,
    };
    let before = tuning.measure(&start)?;
    let settings = RunSettings {
        config,
        fingerprint: fingerprint(&start, step, &set, config),
        optimizer: tuning.settings.optimizer,
        average_decay: tuning.settings.average_decay,
    };
    let batches = |state: &Checkpoint| {
        let batch = tuning.batch(state.samples);
        Ok((batch.len() as u64, batch))
    };
    let finished = run(&tuning, settings, Some(before), batches, report)?;
    let Finished {
        network,
        state,
        metrics,
    } = finished;
    let after = match metrics {
        Some(metrics) => metrics,
        // Everything came from the checkpoint.
        None => tuning.measure(&network)?,
    };
    Ok(Tuned {
        network,
        state,
        before,
        after,
    })
}

/// Step 2 or 3, as the loop sees it.
struct Tuning<'a> {
    step: TuningStep,
    settings: TuningSettings,
    set: TuningSet<'a>,
    config: &'a TrainConfig,
    /// Plain.
    device: &'a Device,
    differentiable: Device,
    /// Of the template, in the colours that [`Light`] asks for.
    texture: TexturePyramid,
    /// Where rest positions are looked up.
    surface: Option<RestSurface>,
    /// The network that the step starts from, on the plain device.
    start: &'a Network,
}

impl<'a> Tuning<'a> {
    fn frames_per_epoch(&self) -> u64 {
        self.set.frames.training.len() as u64
    }

    /// The batch after `samples` frames: the frames of an epoch come in an order that is a function of seed and epoch.
    fn batch(&self, samples: u64) -> Vec<&'a TrainingFrame> {
        let frames = &self.set.frames.training;
        let (epoch, first) = (samples / self.frames_per_epoch(), samples % self.frames_per_epoch());
        let mut order: Vec<usize> = (0..frames.len()).collect();
        let mut rng = Pcg64Mcg::seed_from_u64(self.config.seed ^ (epoch + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15));
        order.shuffle(&mut rng);
        let rest = order.into_iter().skip(first as usize);
        rest.take(self.settings.batch.max(1))
            .map(|index| &frames[index])
            .collect()
    }
}

impl<'a> TrainingStep for Tuning<'a> {
    type Batch = Vec<&'a TrainingFrame>;
    type Metrics = RecordingMetrics;

    fn make_network(&self) -> Result<Network, TrainError> {
        let copy = Network::from_folded(&self.start.folded(), self.device)?;
        Ok(copy.train().train_only(&[self.step.block()]))
    }

    fn progress(&self, state: &Checkpoint) -> f64 {
        match self.settings.epochs * self.frames_per_epoch() {
            0 => 1.0,
            samples => state.samples as f64 / samples as f64,
        }
    }

    fn learning_rate(&self, iteration: u64, _: f64) -> f64 {
        self.settings.learning_rate.at(iteration)
    }

    fn is_measurement_due(&self, state: &Checkpoint, _: f64) -> bool {
        state.samples.is_multiple_of(self.frames_per_epoch())
    }

    fn loss(&self, network: &Network, frames: Vec<&'a TrainingFrame>) -> Result<Tensor<1>, TrainError> {
        let device = &self.differentiable;
        let pictures: Vec<&Picture> = frames.iter().map(|frame| &frame.image).collect();
        let images = pictures_to_tensor(&pictures, device);
        let NetworkMaps {
            depth, registration, ..
        } = network.forward_maps(images.clone());
        Ok(match self.step {
            TuningStep::Depth => {
                let range = network.config().depth_range;
                let measured_mm = pixels(&frames, device, |frame| frame.depth_mm.clone());
                let measured = (measured_mm - range.near_mm) / range.span_mm();
                let counts = pixels(&frames, device, |frame| numbers(&frame.depth_counts));
                // The mask of these networks is read from the depth: it has to stay -1 outside.
                let outside = || pixels(&frames, device, |frame| numbers(&frame.outside()));
                let outside = network.says_outside().then(outside);
                self.config.depth_loss.apply(depth, measured, counts, outside, range)
            }
            TuningStep::Registration => {
                let levels: Vec<usize> = frames.iter().map(|frame| frame.level).collect();
                let inside = pixels(&frames, device, |frame| numbers(&frame.inside));
                let registration = match &self.surface {
                    Some(surface) => registration_of_positions(registration, surface)?,
                    None => registration,
                };
                let loss = &self.config.photo_consistency;
                loss.apply(registration, &images, &inside, &self.texture, &levels)
            }
        })
    }

    fn measure(&self, network: &Network) -> Result<RecordingMetrics, TrainError> {
        RecordingMetrics::measure(network, self.set, self.device)
    }

    fn fill(&self, point: &mut CurvePoint, metrics: &RecordingMetrics) {
        let median = |metric: Option<MeanMedian>| metric.map(|m| m.median);
        point.registration_rmse_px = median(metrics.registration_rmse_px);
        // Against the truth where there is one, else against the sensor.
        point.depth_rmse_mm = median(metrics.depth_rmse_mm.or(metrics.measured_depth_rmse_mm));
        point.mask_iou = metrics.mask_iou.map(|m| m.mean);
        point.photo_consistency_error = median(metrics.photo_consistency_error);
    }
}
