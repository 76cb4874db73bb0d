//! Training step 1 (paper, section 4): all blocks, supervised, on synthetic frames made on the fly or read from data sets.

use super::trunk::Trunk;
use crate::config::TrainConfig;
use crate::data::{Loader, SampleSource, TrainingBatch};
use crate::error::TrainError;
use crate::loss::{step_one_loss, supervised_maps_loss};
use crate::run::{Checkpoint, CurvePoint, Fingerprint, Finished, Progress, RunSettings, TrainingStep, run};
use burn::module::Module;
use burn::tensor::{Device, Tensor};
use deepsft::{DeviceKind, NetworkConfig};
use deepsft_geometry::Template;
use deepsft_geometry::metrics::{FrameMetrics, Summary, frame_metrics};
use deepsft_network::{Network, start_device};
use deepsft_synth::Sample;
use std::sync::Arc;

/// A finished training.
#[derive(Debug)]
pub struct Trained {
    /// The averaged network, on a plain device, folded for inference.
    pub network: Network,
    /// Samples, seconds and the curve.
    pub state: Checkpoint,
}

/// Trains a network of `network_config` on the samples of `source`: step 1. The source is a
/// [`Synthesizer`](deepsft_synth::Synthesizer), or [`StoredSamples`](crate::StoredSamples), all of which are an epoch. `device`
/// is a plain one; differentiation is switched on here. It reports through `report`. The compact network learns cells and bins
/// of windows of frames, the others the paper's loss on the maps of whole frames.
///
/// # Errors
/// [`TrainError`] for a checkpoint that cannot be read, written or continued, samples that are too few or cannot be read, a
/// loss or weights that are no longer finite, or a device that fails.
pub fn train<S: SampleSource + ?Sized + 'static>(
    source: &Arc<S>,
    network_config: &NetworkConfig,
    config: &TrainConfig,
    device: &Device,
    report: impl FnMut(Progress),
) -> Result<Trained, TrainError> {
    let trunk = config.from.as_deref().map(Trunk::read).transpose()?;
    let epoch_samples = source
        .training_samples(config.held_out_frames)?
        .or(config.epoch_samples);
    // Each kind of device has random numbers of its own: a seed stands for the same first weights on all of them.
    let (cpu, _) = pollster::block_on(start_device(DeviceKind::Cpu))?;
    cpu.seed(config.seed);
    let step = StepOne {
        template: source.template(),
        network_config,
        config,
        trunk: trunk.as_ref(),
        device,
        cpu: cpu.autodiff(),
        differentiable: device.clone().autodiff(),
        held_out: source.held_out(config.held_out_seed, config.held_out_frames)?,
    };
    let settings = RunSettings {
        config,
        fingerprint: fingerprint(&**source, network_config, config, epoch_samples, trunk.as_ref()),
        optimizer: config.optimizer,
        average_decay: config.average_decay,
    };
    let mut loader = Loader::start(source, network_config, config.seed, epoch_samples, config.workers);
    let mut asked = 0;
    let batches = |state: &Checkpoint| {
        asked = asked.max(state.samples);
        while loader.wanted() > 0 {
            let shape = match network_config.as_compact() {
                // By where the batch begins, not by where the training stands when it is asked for: a training that resumes
                // asks for it at another moment.
                Some(_) => config.schedule.shape(config.budget.progress(state.seconds, asked)),
                None => config.schedule.frames,
            };
            loader.ask(asked, shape);
            asked += shape.frames as u64;
        }
        let (shape, batch) = loader.take()?;
        Ok((shape.frames as u64, batch))
    };
    let Finished { network, state, .. } = run(&step, settings, None, batches, report)?;
    Ok(Trained {
        network: network.fold(),
        state,
    })
}

/// The names of the parts, as [`CheckpointMismatch`](crate::TrainError::CheckpointMismatch) has them.
const SAMPLES: &str = "template or with other training images";
const NETWORK: &str = "network";
const SETTINGS: &str = "preset (optimiser, learning rates, batches, loss, averaging or epochs)";

const BEGINNING: &str = "beginning (--from)";

/// What must be equal for a checkpoint to be continued: the samples, the network and the settings. Of the budget only
/// fractions count. `epoch_samples` are those of an epoch of `source`.
fn fingerprint(
    source: &(impl SampleSource + ?Sized),
    network: &NetworkConfig,
    config: &TrainConfig,
    epoch_samples: Option<u64>,
    trunk: Option<&Trunk>,
) -> Fingerprint {
    let settings = (&config.optimizer, &config.schedule, config.average_decay, epoch_samples);
    let fingerprint = Fingerprint::default()
        .with(SAMPLES, &source.fingerprint())
        .with(NETWORK, network)
        .with(SETTINGS, &settings);
    match trunk {
        Some(trunk) => fingerprint.with(BEGINNING, &trunk.sha256),
        None => fingerprint,
    }
}

/// Step 1, as the loop sees it.
struct StepOne<'a> {
    template: &'a Template,
    network_config: &'a NetworkConfig,
    config: &'a TrainConfig,
    trunk: Option<&'a Trunk>,
    /// Plain.
    device: &'a Device,
    /// Where weights begin.
    cpu: Device,
    differentiable: Device,
    held_out: Vec<Sample>,
}

impl TrainingStep for StepOne<'_> {
    type Batch = TrainingBatch;
    /// Of each held-out frame that shows the template.
    type Metrics = Vec<FrameMetrics>;

    fn make_network(&self) -> Result<Network, TrainError> {
        let network = Network::new(self.network_config, &self.cpu);
        let network = match self.trunk {
            Some(Trunk { path, weights, .. }) => network.with_trunk(&path.display().to_string(), weights)?,
            None => network,
        };
        Ok(network.fork(&self.differentiable))
    }

    fn progress(&self, state: &Checkpoint) -> f64 {
        self.config.budget.progress(state.seconds, state.samples)
    }

    fn learning_rate(&self, iteration: u64, progress: f64) -> f64 {
        self.config.schedule.learning_rate(iteration, progress)
    }

    fn is_measurement_due(&self, _: &Checkpoint, seconds: f64) -> bool {
        seconds >= self.config.evaluate_every
    }

    /// Ours for the compact network, the paper's for those that say full-resolution maps.
    fn loss(&self, network: &Network, batch: TrainingBatch) -> Result<Tensor<1>, TrainError> {
        match batch {
            TrainingBatch::Cells(batch) => {
                let compact = network.as_compact().ok_or_else(|| TrainError::Architecture {
                    actual: network.config().architecture.name(),
                    expected: "compact",
                })?;
                let tensors = batch.into_tensors(&self.differentiable);
                let output = compact.forward_windows(tensors.images.clone(), Some(&tensors.corners));
                Ok(step_one_loss(output, &tensors))
            }
            TrainingBatch::Maps(batch) => {
                let tensors = batch.into_tensors(&self.differentiable);
                let maps = network.forward_maps(tensors.images);
                Ok(supervised_maps_loss(&maps, &tensors.depth, &tensors.registration))
            }
        }
    }

    fn measure(&self, network: &Network) -> Result<Vec<FrameMetrics>, TrainError> {
        let surface = network.config().rest_surface(self.template);
        let mut frames = Vec::new();
        for sample in self.held_out.iter().filter(|sample| sample.has_template) {
            let maps = pollster::block_on(network.infer(&sample.image, None, surface.as_ref(), self.device))?;
            frames.push(frame_metrics(&maps, &sample.truth, &sample.camera, self.template)?);
        }
        Ok(frames)
    }

    fn fill(&self, point: &mut CurvePoint, frames: &Vec<FrameMetrics>) {
        let summary = |metric: fn(&FrameMetrics) -> Option<f64>| Summary::of(frames.iter().map(metric));
        let median = |metric| summary(metric).map(|s| s.median);
        point.registration_rmse_px = median(|m| m.registration_rmse_px);
        point.depth_rmse_mm = median(|m| m.depth_rmse_mm);
        point.mask_iou = summary(|m| m.mask_iou).map(|s| s.mean);
    }
}
