//! `deepsft-baselines train`: a network of others, trained from nothing on our synthetic samples.

use crate::frames::{Condition, name};
use crate::networks::{Batch, RivalNetwork, Settings, TrainingState, read_checkpoint};
use crate::stopwatch::seconds;
use anyhow::{Context, Result, ensure};
use burn::module::Module;
use burn::optim::{GradientsParams, ModuleOptimizer};
use burn::tensor::Device;
use clap::Args;
use deepsft_formats::read_template;
use deepsft_geometry::Template;
use deepsft_synth::{Sample, Synthesizer, samples};
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
    /// Folder of the template, a flat sheet
    #[arg(long, value_name = "DIR")]
    template: PathBuf,
    /// Minutes of training, of processor time
    #[arg(long, value_name = "M", default_value_t = 5.0)]
    minutes: f64,
    #[command(flatten)]
    settings: Settings,
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

impl Training {
    /// A training from new weights.
    fn new(settings: Settings, template: &Template) -> Result<Self> {
        let device = Device::flex().autodiff();
        let grid = template.grid();
        let grid = grid.context("the template is no flat sheet, which these networks are for")?;
        let optimizer = Optimizer::AdamW {
            weight_decay: 1e-4,
            clip: 1.0,
        };
        Ok(Self {
            network: RivalNetwork::new(&settings, grid, &device),
            optimizer: optimizer.init(),
            device,
            grid,
            state: TrainingState::new(settings, template),
        })
    }

    /// Goes on from a checkpoint of the same training.
    fn resumed(mut self, (saved, network): (SavedFiles<TrainingState>, RivalNetwork)) -> Result<Self> {
        ensure!(
            saved.state.settings == self.state.settings,
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
        let (value, seen) = (f64::from(loss.clone().into_scalar::<f32>()), self.state.samples());
        ensure!(
            value.is_finite(),
            "the loss is {value} after {seen} samples; train anew with another seed"
        );
        let gradients = GradientsParams::from_grads(loss.backward(), &self.network);
        self.network = self.optimizer.step(rate, self.network, gradients);
        self.state.updates += 1;
        Ok((self, value))
    }
}

pub fn run(arguments: &TrainArguments) -> Result<()> {
    let (template, settings) = (read_template(&arguments.template)?, arguments.settings);
    let folder = arguments.out.join(name(settings.method));
    let mut training = Training::new(settings, &template)?;
    let read = || read_checkpoint(&folder, &template, &training.device);
    if let Some(saved) = arguments.resume.then(read).transpose()?.flatten() {
        training = training.resumed(saved).with_context(|| folder.display().to_string())?;
    }
    eprintln!("{} parameters", training.network.num_params());
    // Those of the samples to measure on begin at another seed.
    let synthesizer = Synthesizer::new(&template, Condition::Trained.config())?;
    let mut samples = samples(synthesizer, settings.seed, training.state.samples()..u64::MAX);
    let schedule = Schedule {
        peak: PEAK,
        ..Schedule::default()
    };
    let began = seconds() - training.state.seconds;
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
        let batch = samples.by_ref().take(settings.batch as usize);
        let batch = batch.collect::<Result<Vec<_>, _>>()?;
        let rate = schedule.learning_rate(training.state.updates, progress);
        let (next, loss) = training.update(&batch, rate)?;
        training = next;
        training.state.seconds = seconds() - began;
        (sum, count) = (sum + loss, count + 1.0);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::networks::{Rival, Said};
    use deepsft_geometry::glam::DVec2;
    use deepsft_geometry::{Camera, Picture};
    use deepsft_synth::SynthConfig;

    fn template() -> Template {
        let picture = Picture::from_fn(96, 68, |x, y| {
            [2 * x as u8, 3 * y as u8, ((x / 8 + y / 8) % 2 * 200) as u8]
        });
        Template::thin_shell(picture, 297.0, 210.0).unwrap()
    }

    fn settings(method: Rival) -> Settings {
        Settings {
            method,
            width_divisor: 16,
            batch: 1,
            seed: 1,
        }
    }

    /// A small image: 160 x 96 pixels.
    fn sample(template: &Template) -> Sample {
        let camera = Camera::pinhole((160, 96), DVec2::splat(150.0), DVec2::new(80.0, 48.0)).unwrap();
        let config = SynthConfig {
            min_visible_px: 2000,
            camera,
            ..Condition::Trained.config()
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
                let square = |pixel: usize| f64::from(said[pixel] - truth.depth()[pixel]).powi(2);
                root(seen.map(square).collect())
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
            let mut training = Training::new(settings(method), &template).unwrap();
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
        let new = |settings: Settings| Training::new(settings, &template).unwrap();
        let (first, _) = step(new(settings(Rival::HdmNet)));
        first.save(&folder).unwrap();
        let (device, plain) = (first.device.clone(), Device::flex());
        let read = |folder: &Path, device: &Device| read_checkpoint(folder, &template, device);
        let saved = read(&folder, &device).unwrap().unwrap();
        let resumed = new(settings(Rival::HdmNet)).resumed(saved).unwrap();
        assert_eq!(resumed.state.updates, 1);
        // The same weights and the same optimiser: the loss after another step is the same.
        let losses = [first, resumed].map(|training| step(step(training).0).1);
        assert!((losses[0] - losses[1]).abs() < 1e-6 * losses[0], "{losses:?}");
        let other = Settings {
            seed: 2,
            ..settings(Rival::HdmNet)
        };
        let saved = read(&folder, &plain).unwrap().unwrap();
        let error = new(other).resumed(saved).err().unwrap().to_string();
        assert!(error.contains("seed"), "{error}");
        std::fs::write(folder.join("network.bpk"), b"broken").unwrap();
        let error = read(&folder, &plain).unwrap_err().to_string();
        assert!(error.contains("network.bpk"), "{error}");
        assert!(error.contains("not as it was saved"), "{error}");
        assert!(read(&folder.join("none"), &plain).unwrap().is_none());
    }
}
