//! `deepsft-baselines train`: a network of others, trained from nothing on our synthetic samples.

use crate::networks::{Batch, Rival, RivalNetwork, TrainingState, read_checkpoint};
use crate::stopwatch::Stopwatch;
use anyhow::{Context, Result, bail, ensure};
use burn::module::Module;
use burn::optim::{GradientsParams, ModuleOptimizer};
use burn::tensor::Device;
use clap::Args;
use deepsft_formats::{read_template, template_fingerprint};
use deepsft_geometry::Template;
use deepsft_synth::{Sample, SynthConfig, Synthesizer, samples};
use deepsft_train::{CheckpointFolder, NETWORK_FILE, Optimizer, SavedFiles, Schedule};
use std::path::{Path, PathBuf};

/// Seconds between two checkpoints.
const SAVE_S: f64 = 60.0;

/// Largest learning rate: 1e-4, the authors' of DenseDepth and BTS, is for weights of ImageNet.
const PEAK: f64 = 1e-3;

#[derive(Args)]
#[command(after_help = "\
Samples are made on the fly, never the same one twice, as those of `compare --stills` with another seed. The optimiser is AdamW, whose rate rises
and falls along a cosine over the minutes, which are of processor time, all threads together. A checkpoint is saved every minute and in the end;
--resume goes on from it.

Examples:
  deepsft-baselines train hdm-net --template models/poster-a4/template --minutes 5 --out trained
  deepsft-baselines compare --template models/poster-a4/template --trained trained --out compared")]
pub struct TrainArguments {
    /// The network
    #[arg(value_name = "METHOD", value_enum)]
    method: Rival,
    /// Folder of the template, a flat sheet
    #[arg(long, value_name = "DIR")]
    template: PathBuf,
    /// Minutes of training, of processor time
    #[arg(long, value_name = "M", default_value_t = 5.0)]
    minutes: f64,
    /// What all widths are divided by: 1 for the authors', for which a GPU is needed
    #[arg(long, value_name = "N", default_value_t = 8, value_parser = clap::value_parser!(u64).range(1..=32))]
    width_divisor: u64,
    /// Samples in a batch
    #[arg(long, value_name = "N", default_value_t = 4, value_parser = clap::value_parser!(u64).range(2..=64))]
    batch: u64,
    /// Seed of samples and weights
    #[arg(long, value_name = "S", default_value_t = 1)]
    seed: u64,
    /// Go on from the checkpoint, if there is one
    #[arg(long)]
    resume: bool,
    /// Folder of trained networks: the checkpoint is in DIR/METHOD
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
}

/// A network in training.
struct Training {
    network: RivalNetwork,
    optimizer: ModuleOptimizer,
    device: Device,
    grid: (usize, usize),
    state: TrainingState,
}

fn optimizer() -> ModuleOptimizer {
    Optimizer::AdamW {
        weight_decay: 1e-4,
        clip: 1.0,
    }
    .init()
}

impl Training {
    /// The training that `state` describes, from new weights.
    fn new(state: TrainingState, template: &Template) -> Result<Self> {
        let device = Device::flex().autodiff();
        device.seed(state.seed);
        let grid = template
            .grid()
            .context("the template is no flat sheet, which these networks are for")?;
        Ok(Self {
            network: RivalNetwork::new(state.method, grid, state.width_divisor, &device),
            optimizer: optimizer(),
            device,
            grid,
            state,
        })
    }

    /// Goes on from a checkpoint of the same training.
    fn resumed(mut self, (saved, network): (SavedFiles<TrainingState>, RivalNetwork)) -> Result<Self> {
        let settings = |state: &TrainingState| (state.method, state.width_divisor, state.batch, state.seed);
        let is_same = settings(&saved.state) == settings(&self.state);
        ensure!(
            is_same,
            "the checkpoint has another method, width, batch or seed; leave out --resume to begin anew"
        );
        self.optimizer = saved.optimizer(self.optimizer)?;
        (self.network, self.state) = (network, saved.state);
        Ok(self)
    }

    /// Saves into `folder`, whole or not at all.
    fn save(&self, folder: &Path) -> Result<()> {
        let networks = [(NETWORK_FILE, &self.network.valid())];
        Ok(CheckpointFolder::new(folder).write(&self.state, &networks, &self.optimizer)?)
    }

    /// One step on `samples`; the loss before it.
    fn update(mut self, samples: &[Sample], rate: f64) -> Result<(Self, f64)> {
        let loss = self.network.loss(&Batch::new(samples, self.grid, &self.device));
        let value = f64::from(loss.clone().into_scalar::<f32>());
        if !value.is_finite() {
            bail!(
                "the loss is {value} after {} samples; train anew with another seed",
                self.state.samples()
            );
        }
        let gradients = GradientsParams::from_grads(loss.backward(), &self.network);
        self.network = self.optimizer.step(rate, self.network, gradients);
        self.state.updates += 1;
        Ok((self, value))
    }
}

pub fn run(arguments: &TrainArguments) -> Result<()> {
    let template = read_template(&arguments.template)?;
    let folder = arguments.out.join(arguments.method.name());
    let mut training = Training::new(
        TrainingState {
            method: arguments.method,
            width_divisor: arguments.width_divisor as usize,
            batch: arguments.batch as usize,
            seed: arguments.seed,
            template: template_fingerprint(&template),
            updates: 0,
            seconds: 0.0,
            losses: Vec::new(),
        },
        &template,
    )?;
    let saved = arguments
        .resume
        .then(|| read_checkpoint(&folder, &template, &training.device))
        .transpose()?;
    if let Some(saved) = saved.flatten() {
        training = training.resumed(saved).with_context(|| folder.display().to_string())?;
    }
    eprintln!("{} parameters", training.network.num_params());
    let config = SynthConfig {
        empty_probability: 0.0,
        ..SynthConfig::default()
    };
    // Those of the samples to measure on begin at another seed.
    let first = training.state.samples();
    let mut samples = samples(Synthesizer::new(&template, config)?, arguments.seed, first..u64::MAX);
    let schedule = Schedule {
        peak: PEAK,
        ..Schedule::default()
    };
    let (seconds_before, clock) = (training.state.seconds, Stopwatch::start());
    let (mut sum, mut count, mut saved_s) = (0.0, 0.0, training.state.seconds);
    loop {
        let progress = training.state.seconds / (60.0 * arguments.minutes).max(1.0);
        if count > 0.0 && (progress >= 1.0 || training.state.seconds - saved_s > SAVE_S) {
            training.state.losses.push(sum / count);
            training.save(&folder)?;
            let (samples, minutes) = (training.state.samples(), training.state.seconds / 60.0);
            eprintln!("{samples} samples, {minutes:.1} min, loss {:.5}", sum / count);
            (sum, count, saved_s) = (0.0, 0.0, training.state.seconds);
        }
        if progress >= 1.0 {
            return Ok(());
        }
        let batch = samples
            .by_ref()
            .take(arguments.batch as usize)
            .collect::<Result<Vec<_>, _>>()?;
        let rate = schedule.learning_rate(training.state.updates, progress);
        let (next, loss) = training.update(&batch, rate)?;
        training = next;
        training.state.seconds = seconds_before + clock.seconds();
        (sum, count) = (sum + loss, count + 1.0);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::networks::Said;
    use deepsft_geometry::glam::DVec2;
    use deepsft_geometry::{Camera, Picture};

    fn template() -> Template {
        let picture = Picture::from_fn(96, 68, |x, y| {
            [2 * x as u8, 3 * y as u8, ((x / 8 + y / 8) % 2 * 200) as u8]
        });
        Template::thin_shell(picture, 297.0, 210.0).unwrap()
    }

    fn state(method: Rival, template: &Template) -> TrainingState {
        TrainingState {
            method,
            width_divisor: 16,
            batch: 1,
            seed: 1,
            template: template_fingerprint(template),
            updates: 0,
            seconds: 0.0,
            losses: Vec::new(),
        }
    }

    /// A small image: 160 x 96 pixels.
    fn sample(template: &Template) -> Sample {
        let camera = Camera::pinhole((160, 96), DVec2::splat(150.0), DVec2::new(80.0, 48.0)).unwrap();
        let config = SynthConfig {
            empty_probability: 0.0,
            min_visible_px: 2000,
            camera,
            ..SynthConfig::default()
        };
        Synthesizer::new(template, config).unwrap().sample(3, 0)
    }

    /// How far the answer to `sample` is off: RMSE of vertices, or of depth where the sheet is seen, mm.
    fn error_mm(network: &RivalNetwork, sample: &Sample) -> f64 {
        let root = |squares: Vec<f64>| (squares.iter().sum::<f64>() / squares.len() as f64).sqrt();
        match network.valid().say(&sample.image, &Device::flex()).unwrap() {
            Said::Vertices(vertices) => {
                let pairs = vertices.iter().zip(&sample.vertices_camera);
                root(pairs.map(|(a, b)| a.distance_squared(*b)).collect())
            }
            Said::Depth(maps) => {
                let (said, truth) = (maps.depth(), &sample.truth);
                let seen = (0..said.len()).filter(|&pixel| truth.inside(pixel));
                root(
                    seen.map(|pixel| f64::from(said[pixel] - truth.depth()[pixel]).powi(2))
                        .collect(),
                )
            }
        }
    }

    #[test]
    fn every_network_learns_one_sample_by_heart() {
        let template = template();
        let sample = sample(&template);
        for (method, updates, left) in [
            (Rival::HdmNet, 300, 0.1),
            (Rival::IsmoGan, 300, 0.15),
            // An untrained DenseDepth says 10 m: what is left is far below the spread of the sheet's depths.
            (Rival::DenseDepth, 150, 0.002),
            (Rival::Bts, 150, 0.02),
        ] {
            let mut training = Training::new(state(method, &template), &template).unwrap();
            let before = error_mm(&training.network, &sample);
            for update in 0..updates {
                let rate = 1e-2 * (1.0 - f64::from(update) / f64::from(updates));
                training = training.update(std::slice::from_ref(&sample), rate).unwrap().0;
            }
            let after = error_mm(&training.network, &sample);
            eprintln!("{method:?}: {before} mm, then {after} mm");
            assert!(after < left * before, "{method:?}: {before} mm, then {after} mm");
        }
    }

    #[test]
    fn a_training_goes_on_from_its_checkpoint_and_refuses_a_broken_one() {
        let template = template();
        let sample = [sample(&template)];
        let step = |training: Training| training.update(&sample, 1e-3).unwrap();
        let folder = tempfile::tempdir().unwrap();
        let folder = folder.path().join("hdm-net");
        let (first, _) = step(Training::new(state(Rival::HdmNet, &template), &template).unwrap());
        first.save(&folder).unwrap();
        let read = || read_checkpoint(&folder, &template, &first.device);
        let new = |state: TrainingState| Training::new(state, &template).unwrap();
        let resumed = new(state(Rival::HdmNet, &template))
            .resumed(read().unwrap().unwrap())
            .unwrap();
        assert_eq!(resumed.state.updates, 1);
        // The same weights and the same optimiser: the loss after another step is the same.
        let losses = [first, resumed].map(|training| step(step(training).0).1);
        assert!((losses[0] - losses[1]).abs() < 1e-6 * losses[0], "{losses:?}");
        let device = Device::flex();
        let other = TrainingState {
            seed: 2,
            ..state(Rival::HdmNet, &template)
        };
        let error = new(other)
            .resumed(read_checkpoint(&folder, &template, &device).unwrap().unwrap())
            .err()
            .unwrap();
        assert!(error.to_string().contains("seed"), "{error}");
        std::fs::write(folder.join("network.bpk"), b"broken").unwrap();
        let error = read_checkpoint(&folder, &template, &device).unwrap_err().to_string();
        assert!(
            error.contains("network.bpk") && error.contains("not as it was saved"),
            "{error}"
        );
        assert!(
            read_checkpoint(&folder.join("none"), &template, &device)
                .unwrap()
                .is_none()
        );
    }
}
