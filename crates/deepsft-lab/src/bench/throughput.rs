//! Samples per second: made, and trained on.

use anyhow::{Context, Result};
use deepsft::{DeviceKind, ModelBundle};
use deepsft_formats::read_template;
use deepsft_geometry::Template;
use deepsft_network::start_device;
use deepsft_synth::{SynthConfig, Synthesizer};
use deepsft_train::{BatchShape, Budget, Progress, Schedule, TrainConfig, train};
use rayon::prelude::*;
use serde::Serialize;
use std::hint::black_box;
use std::path::Path;
use std::sync::Arc;
use std::time::Instant;

const SAMPLES_PER_THREAD: u64 = 200;

const SEED: u64 = 0xbe_4c;

/// Steps of training before the clock starts: the loader's queues fill, memory is claimed.
const WARM_UP_STEPS: u64 = 4;

/// Steps of training that are measured.
const STEPS: u64 = 12;

/// The template of an object with a volume.
const SOFT_TOY: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../models/soft-toy/template");

#[derive(Debug, PartialEq, Serialize)]
pub struct Rate {
    /// What is counted.
    pub of: String,
    pub samples_per_s: f64,
}

type Preset = (&'static str, fn() -> SynthConfig);

const PRESETS: [Preset; 2] = [("default", SynthConfig::default), ("paper", SynthConfig::paper)];

/// Making samples of the bundle's template and of the soft toy, with each preset, on one thread and on `cores`.
pub fn synthesis(template: &Template, cores: usize) -> Result<Vec<Rate>> {
    let mut rates = Vec::new();
    let mut counts = vec![1, cores];
    counts.dedup();
    let soft_toy = read_template(Path::new(SOFT_TOY))?;
    for (object, template) in [("template", template), ("soft toy", &soft_toy)] {
        for (preset, config) in PRESETS {
            let synthesizer = Synthesizer::new(template, config())?;
            for &threads in &counts {
                rates.push(synthesis_on(&synthesizer, object, preset, threads)?);
            }
        }
    }
    Ok(rates)
}

fn synthesis_on(synthesizer: &Synthesizer, object: &str, preset: &str, threads: usize) -> Result<Rate> {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build()?;
    let count = SAMPLES_PER_THREAD * threads as u64;
    let started = Instant::now();
    pool.install(|| {
        (0..count)
            .into_par_iter()
            .for_each(|index| drop(black_box(synthesizer.sample(SEED, index))))
    });
    Ok(Rate {
        of: format!(
            "{object}, {preset} preset, {threads} thread{}",
            if threads == 1 { "" } else { "s" }
        ),
        samples_per_s: count as f64 / started.elapsed().as_secs_f64(),
    })
}

/// Training step 1 of a new network of the bundle's shape, on windows and on whole frames, the making of
/// the samples included.
pub fn training(bundle: &ModelBundle) -> Result<Vec<Rate>> {
    let synthesizer = Arc::new(Synthesizer::new(bundle.template(), SynthConfig::default())?);
    let Schedule { windows, frames, .. } = Schedule::default();
    [(windows, "windows"), (frames, "frames")]
        .into_iter()
        .map(|(shape, things)| {
            let [count, width, height] = [shape.frames, shape.width, shape.height];
            let samples_per_s = training_on(bundle, &synthesizer, shape)?;
            Ok(Rate {
                of: format!("batches of {count} {things} of {width} x {height}"),
                samples_per_s,
            })
        })
        .collect()
}

/// Samples per second of training on batches of one shape.
fn training_on(bundle: &ModelBundle, synthesizer: &Arc<Synthesizer>, shape: BatchShape) -> Result<f64> {
    let folder = tempfile::tempdir()?;
    let config = TrainConfig {
        budget: Budget::Samples((WARM_UP_STEPS + STEPS) * shape.frames as u64),
        seed: SEED,
        held_out_frames: 1,
        evaluate_every: f64::INFINITY,
        checkpoint: folder.path().join("checkpoint"),
        schedule: Schedule {
            windows: shape,
            frames: shape,
            ..Schedule::default()
        },
        ..TrainConfig::ours()
    };
    let (device, _) = pollster::block_on(start_device(DeviceKind::Cpu))?;
    let mut steps = Vec::new();
    train(synthesizer, &bundle.network().config, &config, &device, |progress| {
        if let Progress::Step { samples, seconds, .. } = progress {
            steps.push((samples, seconds));
        }
    })?;
    rate(steps.get(WARM_UP_STEPS as usize - 1..).unwrap_or_default())
        .context("the training ended before it was measured")
}

/// Samples per second between the first and the last of some (samples, seconds) so far.
fn rate(steps: &[(u64, f64)]) -> Option<f64> {
    let (&(samples, seconds), &(all_samples, all_seconds)) = (steps.first()?, steps.last()?);
    (all_samples > samples).then(|| (all_samples - samples) as f64 / (all_seconds - seconds))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_rate_leaves_the_warm_up_out() {
        // 16 samples in 8 s of warm-up, then 32 in 4 s.
        assert_eq!(rate(&[(16, 8.0), (32, 10.0), (48, 12.0)]), Some(8.0));
        assert_eq!(rate(&[(16, 8.0)]), None);
        assert_eq!(rate(&[]), None);
    }
}
