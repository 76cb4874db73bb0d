//! The training itself: steps, measurements on held-out prints, checkpoints.

use super::loss::{Batch, Matcher};
use super::pairs::Pair;
use super::prints::{FRAMES, PrintSource, Shown};
use anyhow::{Context, Result, ensure};
use burn::grad_clipping::GradientClippingConfig;
use burn::module::Module;
use burn::optim::{AdamWConfig, GradientsParams, ModuleOptimizer};
use burn::tensor::Device;
use deepsft::weights_to_burnpack;
use deepsft_synth::random::{Stream, generator};
use deepsft_train::{CheckpointFolder, NETWORK_FILE, Schedule};
use rand::RngExt;
use serde::{Deserialize, Serialize};
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

/// Prints of a batch, and pairs of each.
const PRINTS: usize = 4;
const PAIRS: usize = 2;

/// Prints that are kept to draw from, and steps after which the next one comes in.
const KEPT: usize = 160;
const STEPS_PER_PRINT: u64 = 4;

/// Held-out prints, and pairs of each that are measured.
const HELD_OUT_PRINTS: u64 = 12;

/// Sets the held-out prints apart.
const HELD_OUT_SEED: u64 = 0x68656c64;

/// A point of the curve.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub struct Point {
    pub pairs: u64,
    /// Mean since the last point.
    pub loss: f64,
    pub held_out_loss: f64,
    /// Fraction of the cells of held-out windows whose best match lies within a cell and a half.
    pub right: f64,
}

/// What a checkpoint knows beside weights and optimiser.
#[derive(Serialize, Deserialize)]
struct State {
    seed: u64,
    /// Names of the held-out photographs.
    held_out: Vec<String>,
    steps: u64,
    /// Number of the next print, and of those before it that are drawn from.
    next_print: u64,
    kept: usize,
    curve: Vec<Point>,
}

pub struct Training {
    device: Device,
    matcher: Matcher,
    optimizer: ModuleOptimizer,
    state: State,
    kept: Vec<Shown>,
    held_out: Vec<Vec<Pair>>,
    losses: (f64, u64),
}

impl Training {
    /// From random weights; `photographs` are those that are held out.
    pub fn new(device: &Device, seed: u64, photographs: Vec<PathBuf>) -> Result<Self> {
        device.seed(seed);
        let mut held_out = Vec::new();
        for number in 0..HELD_OUT_PRINTS {
            let shown = Shown::new(seed ^ HELD_OUT_SEED, number, PAIRS, &photographs)?;
            let mut dice = generator(seed ^ HELD_OUT_SEED, number, Stream::Scene);
            held_out.push((0..PAIRS).map(|frame| Pair::new(&shown, frame, &mut dice)).collect());
        }
        Ok(Self {
            matcher: Matcher::new(&device.clone().autodiff()),
            device: device.clone(),
            optimizer: optimizer(),
            state: State {
                seed,
                held_out: photographs.iter().map(|path| path.display().to_string()).collect(),
                steps: 0,
                next_print: 0,
                kept: 0,
                curve: Vec::new(),
            },
            kept: Vec::new(),
            held_out,
            losses: (0.0, 0),
        })
    }

    pub fn pairs(&self) -> u64 {
        self.state.steps * (PRINTS * PAIRS) as u64
    }

    /// Number of the next print that [`Training::step`] asks for.
    pub fn next_print(&self) -> u64 {
        self.state.next_print
    }

    /// An update of the weights at the fraction `progress` of the training; the loss before it.
    pub fn step(&mut self, source: &PrintSource, progress: f64) -> Result<f64> {
        let (seed, steps) = (self.state.seed, self.state.steps);
        // After a checkpoint those that were kept are rendered again.
        while self.kept.len() < self.state.kept.max(PRINTS) {
            self.take(source)?;
        }
        if steps > 0
            && steps.is_multiple_of(STEPS_PER_PRINT)
            && self.state.next_print < PRINTS as u64 + steps / STEPS_PER_PRINT
        {
            self.take(source)?;
        }
        let mut dice = generator(seed, steps, Stream::Shape);
        let mut pairs = Vec::new();
        let first = dice.random_range(0..self.kept.len());
        for k in 0..PRINTS {
            // Different prints: the next one's view stands for what is not there.
            let shown = &self.kept[(first + k * (self.kept.len() / PRINTS)) % self.kept.len()];
            for _ in 0..PAIRS {
                pairs.push(Pair::new(shown, dice.random_range(0..FRAMES), &mut dice));
            }
        }
        let pairs: Vec<&Pair> = pairs.iter().collect();
        let batch = Batch::new(&pairs, &self.device.clone().autodiff());
        let (loss, _) = self.matcher.loss(&batch);
        let value = f64::from(loss.clone().into_scalar::<f32>());
        ensure!(value.is_finite(), "the training diverged after {} pairs", self.pairs());
        // Warm-up, and a cosine from 2e-3 to a fiftieth of it.
        let rate = Schedule::default().learning_rate(steps, progress);
        let gradients = GradientsParams::from_grads(loss.backward(), &self.matcher);
        self.matcher = self.optimizer.step(rate, self.matcher.clone(), gradients);
        self.state.steps += 1;
        self.losses = (self.losses.0 + value, self.losses.1 + 1);
        Ok(value)
    }

    /// Takes the next print in, the oldest out.
    fn take(&mut self, source: &PrintSource) -> Result<()> {
        if self.kept.len() == KEPT {
            self.kept.remove(0);
        }
        self.kept.push(source.next()?);
        self.state.next_print += 1;
        self.state.kept = self.state.kept.max(self.kept.len());
        Ok(())
    }

    /// Measures on the held-out prints and adds a point to the curve.
    pub fn measure(&mut self) -> Result<Point> {
        let matcher = self.matcher.valid();
        let (mut loss, mut right) = (0.0, 0.0);
        let batches = self.held_out.chunks(PRINTS);
        let count = batches.len() as f64;
        for prints in batches {
            let pairs: Vec<&Pair> = prints.iter().flatten().collect();
            let (batch_loss, batch_right) = matcher.loss(&Batch::new(&pairs, &self.device));
            loss += f64::from(batch_loss.into_scalar::<f32>()) / count;
            right += batch_right / count;
        }
        let (sum, steps) = std::mem::take(&mut self.losses);
        let point = Point {
            pairs: self.pairs(),
            loss: sum / steps.max(1) as f64,
            held_out_loss: loss,
            right,
        };
        self.state.curve.push(point);
        Ok(point)
    }

    /// The weights, folded, as a file.
    pub fn weights(&self) -> Result<Vec<u8>> {
        weights_to_burnpack(&self.matcher.network.folded_weights()).context("the weights")
    }

    pub fn curve_csv(&self) -> String {
        let mut table = "pairs,loss,held_out_loss,right\n".to_owned();
        for point in &self.state.curve {
            let [loss, held_out, right] = [point.loss, point.held_out_loss, point.right];
            // Writing to a string cannot fail.
            let _ = writeln!(table, "{},{loss:.4},{held_out:.4},{right:.4}", point.pairs);
        }
        table
    }

    /// Writes the checkpoint in place of the one before.
    pub fn save(&self, folder: &Path) -> Result<()> {
        let networks = [(NETWORK_FILE, &self.matcher.valid())];
        Ok(CheckpointFolder::new(folder).write(&self.state, &networks, &self.optimizer)?)
    }

    /// Goes on from a checkpoint as if there had been no end.
    pub fn resume(&mut self, folder: &Path) -> Result<()> {
        let saved = CheckpointFolder::new(folder).read::<State>()?;
        let saved = saved.with_context(|| format!("there is no checkpoint to go on from: {}", folder.display()))?;
        ensure!(
            saved.state.seed == self.state.seed,
            "{} was made with --seed {}",
            folder.display(),
            saved.state.seed
        );
        ensure!(
            saved.state.held_out == self.state.held_out,
            "{} was made with other --photographs",
            folder.display()
        );
        self.matcher = saved.network(NETWORK_FILE, self.matcher.clone())?;
        self.optimizer = saved.optimizer(optimizer())?;
        self.state = State {
            next_print: saved.state.next_print - (saved.state.kept as u64).min(saved.state.next_print),
            ..saved.state
        };
        Ok(())
    }
}

fn optimizer() -> ModuleOptimizer {
    AdamWConfig::new()
        .with_weight_decay(1e-4)
        .with_grad_clipping(Some(GradientClippingConfig::Norm(1.0)))
        .init()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pairs_show_the_same_in_cells_that_match_and_a_training_learns_and_goes_on() {
        let device = Device::flex();
        let source = PrintSource::start(5, 0, Vec::new());
        let mut training = Training::new(&device, 5, Vec::new()).unwrap();
        let before = training.measure().unwrap().held_out_loss;
        for _ in 0..12 {
            training.step(&source, 0.0).unwrap();
        }
        let after = training.measure().unwrap().held_out_loss;
        assert!(after < 0.97 * before, "{before} {after}");
        let folder = tempfile::tempdir().unwrap();
        let checkpoint = folder.path().join("any.checkpoint");
        training.save(&checkpoint).unwrap();
        let mut again = Training::new(&device, 5, Vec::new()).unwrap();
        again.resume(&checkpoint).unwrap();
        assert_eq!(again.pairs(), training.pairs());
        let point = again.measure().unwrap();
        assert!((point.held_out_loss - after).abs() < 1e-4 * after, "{point:?} {after}");
        // As if there had been no end: the same prints, the same pairs.
        let again_source = PrintSource::start(5, again.next_print(), Vec::new());
        let went_on = training.step(&source, 0.5).unwrap();
        let resumed = again.step(&again_source, 0.5).unwrap();
        assert!((resumed - went_on).abs() < 1e-3 * went_on, "{resumed} {went_on}");
        assert_eq!(again.next_print(), training.next_print());
        let mut other = Training::new(&device, 6, Vec::new()).unwrap();
        let error = other.resume(&checkpoint).unwrap_err().to_string();
        assert!(error.contains("--seed 5"), "{error}");
        std::fs::write(checkpoint.join("state.json"), "{").unwrap();
        assert!(
            again
                .resume(&checkpoint)
                .unwrap_err()
                .to_string()
                .contains("state.json")
        );
    }
}
