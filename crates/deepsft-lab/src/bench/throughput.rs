//! Samples per second: made, and trained on.

use anyhow::{Context, Result};
use deepsft::{DeviceKind, ModelBundle};
use deepsft_geometry::Template;
use deepsft_network::start_device;
use deepsft_synth::random::{Stream, generator};
use deepsft_synth::{SampleRecord, SynthConfig, Synthesizer};
use deepsft_train::{BatchShape, Budget, Progress, Schedule, TrainConfig, train};
use rayon::prelude::*;
use serde::Serialize;
use std::hint::black_box;
use std::sync::Arc;
use std::time::Instant;

/// Samples that each thread makes.
const SAMPLES_PER_THREAD: u64 = 200;

/// Seed of the samples.
const SEED: u64 = 0xbe_4c;

/// Steps of training before the clock starts: the loader's queues fill, memory is claimed.
const WARM_UP_STEPS: u64 = 4;

/// Steps of training that are measured.
const STEPS: u64 = 12;

/// A throughput.
#[derive(Debug, PartialEq, Serialize)]
pub struct Rate {
    /// What is counted.
    pub of: String,
    pub samples_per_s: f64,
}

/// Where the time of a sample with the template goes: medians, one thread.
#[derive(Debug, PartialEq, Serialize)]
pub struct SampleTime {
    pub template: &'static str,
    pub preset: &'static str,
    /// A shape and a pose; a sample draws several when the first shows too little.
    pub shape_ms: f64,
    /// Background, other sheets, light, occluders, camera: all that is drawn before the template is placed.
    pub scene_ms: f64,
    /// The template in it, occluders, camera effects, maps.
    pub image_ms: f64,
    /// Coding of the sample for a data set; not part of making one.
    pub coding_ms: f64,
}

type Preset = (&'static str, fn() -> SynthConfig);

const PRESETS: [Preset; 2] = [("default", SynthConfig::default), ("paper", SynthConfig::paper)];

/// Making samples of the bundle's template, with each preset, on one thread and on `cores`.
pub fn synthesis(template: &Template, cores: usize) -> Result<(Vec<Rate>, Vec<SampleTime>)> {
    let (mut rates, mut times) = (Vec::new(), Vec::new());
    synthesis_of("template", template, cores, &mut rates, &mut times)?;
    Ok((rates, times))
}

fn synthesis_of(
    object: &'static str,
    template: &Template,
    cores: usize,
    rates: &mut Vec<Rate>,
    times: &mut Vec<SampleTime>,
) -> Result<()> {
    for (name, config) in PRESETS {
        let synthesizer = Synthesizer::new(template, config())?;
        let mut counts = vec![1, cores];
        counts.dedup();
        for threads in counts {
            rates.push(synthesis_on(&synthesizer, object, name, threads)?);
        }
        times.push(sample_time(&synthesizer, object, name)?);
    }
    Ok(())
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

fn sample_time(synthesizer: &Synthesizer, template: &'static str, preset: &'static str) -> Result<SampleTime> {
    let mut times = [const { Vec::new() }; 4];
    for index in 0..SAMPLES_PER_THREAD {
        let mut clock = Clock::start();
        let vertices = synthesizer.sample_vertices(&mut generator(SEED, index, Stream::Shape));
        times[0].push(clock.lap_ms());
        let scene = synthesizer.scene(SEED, index);
        times[1].push(clock.lap_ms());
        let sample = scene.render(vertices, index)?;
        times[2].push(clock.lap_ms());
        let record = SampleRecord {
            seed: SEED,
            index,
            sample,
        };
        black_box(record.encode()?);
        times[3].push(clock.lap_ms());
    }
    let [shape_ms, scene_ms, image_ms, coding_ms] = times.map(|mut times| {
        times.sort_by(f64::total_cmp);
        times[times.len() / 2]
    });
    Ok(SampleTime {
        template,
        preset,
        shape_ms,
        scene_ms,
        image_ms,
        coding_ms,
    })
}

/// A stop watch.
struct Clock(Instant);

impl Clock {
    fn start() -> Self {
        Self(Instant::now())
    }

    /// Milliseconds since the start or the last lap.
    fn lap_ms(&mut self) -> f64 {
        let last = std::mem::replace(&mut self.0, Instant::now());
        (self.0 - last).as_secs_f64() * 1e3
    }
}

/// Training step 1 of a new network of the bundle's shape, on windows and on whole frames, the making of
/// the samples included.
pub fn training(bundle: &ModelBundle) -> Result<Vec<Rate>> {
    let synthesizer = Arc::new(Synthesizer::new(bundle.template(), SynthConfig::default())?);
    let Schedule { windows, frames, .. } = Schedule::default();
    [(windows, "windows"), (frames, "frames")]
        .into_iter()
        .map(|(shape, things)| {
            let BatchShape {
                frames: count,
                width,
                height,
            } = shape;
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
