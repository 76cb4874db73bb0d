//! Steps 2 and 3 of a training: a bundle tuned on an RGB-D recording.

use super::plan::Plan;
use super::progress_lines::tell;
use crate::failure::BlameInput;
use crate::output::curve_plot;
use crate::progress;
use anyhow::Result;
use deepsft::{ModelBundle, encode_png};
use deepsft_geometry::{ColorResponse, training_camera};
use deepsft_network::Network;
use deepsft_synth::{DATASET_FILE, DatasetFolder, Recording, Sample, TRUTH_FOLDER};
use deepsft_train::{
    Checkpoint, Device, Progress, RecordedFrames, RecordingMetrics, TrainConfig, Trained, TuningSet, TuningStep,
    curve_csv, set_aside_outdated, tune, tuning_json, tuning_table,
};
use std::collections::BTreeMap;
use std::path::Path;

/// Name of the file with the figures before and after, in a bundle.
pub const FIGURES_FILE: &str = "tuning.json";

/// What steps on a recording tell.
#[derive(Default)]
pub struct Figures {
    /// Files for the bundle: figures, curves, plots.
    pub files: BTreeMap<String, Vec<u8>>,
    /// The table of figures, as text for people and in the card.
    pub table: String,
}

/// Trains the blocks of the steps of `plan` of the network of `bundle` on the recording in `folder`.
pub fn run(bundle: &ModelBundle, folder: &Path, plan: &Plan<'_>, device: &Device) -> Result<(Trained, Figures)> {
    let recording = Recording::open(folder).blame("recording", folder)?;
    let canonical = training_camera();
    let mut network = Network::from_folded(bundle.network(), device)?;
    let bar = progress::counting(recording.frames() as u64, "frames read");
    let frames = RecordedFrames::read(
        &recording,
        &network,
        bundle.template(),
        &canonical,
        plan.config.held_out_fraction,
        device,
        || bar.inc(1),
    );
    let frames = frames.blame("recording", folder)?;
    bar.finish_and_clear();
    let truth = truth(folder, &frames)?;
    let kind = if recording.sensor().simulated {
        "simulated recording"
    } else {
        "recording"
    };
    let (training, held_out, left_out) = (frames.training.len(), frames.held_out.len(), frames.left_out);
    println!(
        "{kind}: {training} frames to train on, {held_out} held out at its end, {left_out} in which nothing was found"
    );
    println!("{}", colors_line(&frames.colors));
    let set = TuningSet {
        frames: &frames,
        template: bundle.template(),
        canonical: &canonical,
        truth: &truth,
    };
    let mut rows = Vec::new();
    let (before, mut figures) = (&bundle.card().provenance, Figures::default());
    let mut state = Checkpoint {
        samples: before.samples,
        seconds: before.seconds,
        ..Checkpoint::default()
    };
    for &step in &plan.steps {
        println!("step {}: {}", step.number(), step.block().name());
        let config = TrainConfig {
            checkpoint: plan.checkpoint(step),
            ..plan.config.clone()
        };
        if plan.may_be_outdated(step)
            && let Some(kept) = set_aside_outdated(&network, step, set, &config)?
        {
            println!(
                "step {} begins anew: it had started from a network that has been trained further since; its checkpoint is kept as {}",
                step.number(),
                kept.display()
            );
        }
        let (asked, frames_an_epoch) = (plan.epochs(step), frames.training.len() as u64);
        let bar = progress::fraction();
        let done = tune(&network, step, set, &config, device, |told| {
            let begun = match told {
                Progress::Resumed { samples, .. } => samples / frames_an_epoch,
                _ => 0,
            };
            tell(&bar, told);
            if begun > asked {
                bar.suspend(|| {
                    println!("it has {begun} epochs already, more than the {asked} asked for: all are kept")
                });
            }
        })?;
        bar.finish_and_clear();
        if rows.is_empty() {
            rows.push(("before".to_owned(), done.before));
        }
        rows.push((format!("after step {}", step.number()), done.after));
        state.samples += done.state.samples;
        state.seconds += done.state.seconds;
        figures.add(step, &done.state)?;
        network = done.network;
    }
    if let Some(exact) = RecordingMetrics::of_truth(set)? {
        rows.push(("the truth itself".to_owned(), exact));
    }
    figures.table = tuning_table(kind, recording.frames(), frames.held_out.len(), &rows);
    let json = tuning_json(kind, &frames, &rows)?;
    figures.files.insert(FIGURES_FILE.to_owned(), json);
    Ok((Trained { network, state }, figures))
}

impl Figures {
    fn add(&mut self, step: TuningStep, state: &Checkpoint) -> Result<()> {
        let name = |ending: &str| format!("step-{}.{ending}", step.number());
        self.files.insert(name("csv"), curve_csv(&state.curve).into_bytes());
        if let Some(plot) = curve_plot::curve_plot(&state.curve) {
            self.files.insert(name("png"), encode_png(&plot)?);
        }
        Ok(())
    }
}

/// How the camera shows colours, for people.
fn colors_line(colors: &ColorResponse) -> String {
    let of = |values: [f64; 3], digits: usize| values.map(|value| format!("{value:.digits$}")).join(" / ");
    format!(
        "the camera shows the template's red / green / blue times {}, plus {} of 255",
        of(colors.gain, 2),
        of(colors.offset, 0)
    )
}

/// The truth of the held-out frames, where the recording comes with a truth.
fn truth(folder: &Path, frames: &RecordedFrames) -> Result<BTreeMap<usize, Sample>> {
    let truth = folder.join(TRUTH_FOLDER);
    if !truth.join(DATASET_FILE).is_file() {
        return Ok(BTreeMap::new());
    }
    let truth = DatasetFolder::open(&truth)?;
    let mut samples = BTreeMap::new();
    for (index, sample) in truth.samples(training_camera())?.enumerate() {
        let sample = sample?;
        if frames.held_out.iter().any(|frame| frame.index == index) {
            samples.insert(index, sample);
        }
    }
    Ok(samples)
}
