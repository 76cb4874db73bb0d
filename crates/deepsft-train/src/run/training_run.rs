//! The loop of every training step: it resumes, updates the weights, measures and saves.

use super::checkpoint::{Checkpoint, CheckpointFolder, CurvePoint};
use super::fingerprint::Fingerprint;
use super::progress::Progress;
use super::weight_average::WeightAverage;
use crate::config::{Optimizer, TrainConfig};
use crate::error::TrainError;
use burn::module::Module;
use burn::optim::GradientsParams;
use burn::tensor::Tensor;
use deepsft_network::Network;
use std::time::Instant;

/// What one of the paper's training steps brings to the loop.
pub(crate) trait TrainingStep {
    /// What one update learns from.
    type Batch;
    /// What a measurement finds.
    type Metrics;

    /// A network of its own with the weights that the step starts from, on the differentiable device. Not a clone of
    /// another one: clones share the running statistics of batch normalisation.
    fn make_network(&self) -> Result<Network, TrainError>;

    /// The fraction of the training that is done; 1 or more ends it.
    fn progress(&self, state: &Checkpoint) -> f64;

    /// The learning rate of iteration `iteration`, at the fraction `progress` of the training.
    fn learning_rate(&self, iteration: u64, progress: f64) -> f64;

    /// Whether to measure and save now, `seconds` of training after the last time.
    fn is_measurement_due(&self, state: &Checkpoint, seconds: f64) -> bool;

    /// What is minimised, [1], of `batch`.
    fn loss(&self, network: &Network, batch: Self::Batch) -> Result<Tensor<1>, TrainError>;

    /// Measures `network`, which is on the plain device, on the held-out frames.
    fn measure(&self, network: &Network) -> Result<Self::Metrics, TrainError>;

    /// Puts what was measured into a point of the curve.
    fn fill(&self, point: &mut CurvePoint, metrics: &Self::Metrics);
}

/// The settings of a run that every training step has.
pub(crate) struct RunSettings<'a> {
    /// Checkpoint, seed, and whether to resume.
    pub config: &'a TrainConfig,
    pub fingerprint: Fingerprint,
    pub optimizer: Optimizer,
    /// Decay per iteration of the average of the weights; 0 for the weights themselves.
    pub average_decay: f64,
}

/// What a run ends with.
pub(crate) struct Finished<M> {
    /// The averaged network, on the plain device.
    pub network: Network,
    pub state: Checkpoint,
    /// The last measurement, if this run made one.
    pub metrics: Option<M>,
}

/// Runs `step` to its end from the beginning or from its checkpoint. `before` is a measurement of the first weights that
/// is known already. `batches` gives the next batch and its number of frames from where the training stands; it is first
/// called after a checkpoint was read.
///
/// # Errors
/// [`TrainError`] for a checkpoint that cannot be read, written or continued, a loss or weights that are no longer finite,
/// and those of `step` and `batches`.
pub(crate) fn run<T: TrainingStep>(
    step: &T,
    settings: RunSettings<'_>,
    before: Option<T::Metrics>,
    mut batches: impl FnMut(&Checkpoint) -> Result<(u64, T::Batch), TrainError>,
    mut report: impl FnMut(Progress),
) -> Result<Finished<T::Metrics>, TrainError> {
    let (config, average_decay) = (settings.config, settings.average_decay);
    let folder = CheckpointFolder::new(&config.checkpoint);
    let mut network = step.make_network()?;
    let mut optimizer = settings.optimizer.init();
    let mut average = WeightAverage::new(&network, average_decay, 0);
    let mut state = Checkpoint {
        fingerprint: settings.fingerprint,
        seed: config.seed,
        ..Checkpoint::default()
    };
    if config.resume
        && let Some(saved) = folder.load(
            || step.make_network(),
            settings.optimizer.init(),
            &state.fingerprint,
            config.seed,
        )?
    {
        let averaged = saved.average.as_ref().unwrap_or(&saved.network);
        average = WeightAverage::new(averaged, average_decay, saved.state.step);
        (network, optimizer, state) = (saved.network, saved.optimizer, saved.state);
        report(Progress::Resumed {
            samples: state.samples,
            seconds: state.seconds,
        });
    }
    let point = |state: &Checkpoint, loss: f64, progress: f64, metrics: &T::Metrics| {
        let mut point = CurvePoint {
            samples: state.samples,
            seconds: state.seconds,
            loss,
            learning_rate: step.learning_rate(state.step, progress),
            ..CurvePoint::default()
        };
        step.fill(&mut point, metrics);
        point
    };
    let mut metrics = None;
    if state.curve.is_empty() {
        // Where the curve starts.
        let first = before.map_or_else(|| step.measure(&average.apply(network.valid())), Ok)?;
        let first_point = point(&state, f64::NAN, 0.0, &first);
        state.curve.push(first_point);
        report(Progress::Evaluated(first_point));
        metrics = Some(first);
    }
    let (mut loss_sum, mut loss_count) = (0.0, 0_u64);
    let mut last_measured = state.seconds;
    let (seconds_before, clock) = (state.seconds, Instant::now());
    let mut paused = 0.0;
    loop {
        let progress = step.progress(&state);
        let finished = progress >= 1.0;
        // A training that resumes from a checkpoint was measured there already.
        let is_measured = state.curve.last().is_some_and(|point| point.samples == state.samples);
        if !is_measured && (finished || step.is_measurement_due(&state, state.seconds - last_measured)) {
            let pause = Instant::now();
            let averaged = average.apply(network.valid());
            let measured = step.measure(&averaged)?;
            // Not a number where nothing was summed.
            let measured_point = point(&state, loss_sum / loss_count as f64, progress, &measured);
            state.curve.push(measured_point);
            let averaged = (average_decay > 0.0).then_some(&averaged);
            folder.save(&state, &network.valid(), averaged, &optimizer)?;
            report(Progress::Evaluated(measured_point));
            (loss_sum, loss_count) = (0.0, 0);
            last_measured = state.seconds;
            metrics = Some(measured);
            paused += pause.elapsed().as_secs_f64();
        }
        if finished {
            break;
        }
        let (frames, batch) = batches(&state)?;
        let loss = step.loss(&network, batch)?;
        let value = f64::from(loss.clone().into_scalar::<f32>());
        if !value.is_finite() {
            let samples = state.samples;
            return Err(TrainError::Diverged { loss: value, samples });
        }
        let gradients = GradientsParams::from_grads(loss.backward(), &network);
        network = optimizer.step(step.learning_rate(state.step, progress), network, gradients);
        average.update(&network);
        state.step += 1;
        state.samples += frames;
        state.seconds = seconds_before + clock.elapsed().as_secs_f64() - paused;
        (loss_sum, loss_count) = (loss_sum + value, loss_count + 1);
        report(Progress::Step {
            // The last batch may go beyond the end.
            fraction: step.progress(&state).min(1.0),
            samples: state.samples,
            seconds: state.seconds,
            loss: value,
        });
    }
    Ok(Finished {
        network: average.apply(network.valid()),
        state,
        metrics,
    })
}
