//! Steps 2 and 3 of a training: a bundle refined on an RGB-D recording.

use super::plan::Plan;
use super::progress_lines::tell;
use crate::clip_folder::TRUTH_FOLDER;
use crate::dataset::{self, DATASET_FILE};
use crate::failure::BlameInput;
use crate::output::{curve_plot, model_card};
use crate::progress;
use anyhow::{Context, Result};
use deepsft::{ModelBundle, Network, encode_png};
use deepsft_geometry::{ColorResponse, training_camera};
use deepsft_synth::{Recording, Sample};
use deepsft_train::{
    Checkpoint, Device, MeanMedian, Progress, RecordedFrames, RecordingMetrics, TrainConfig, TuningSet, TuningStep,
    set_aside_outdated, tune,
};
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::path::Path;

/// Name of the file with the figures before and after, in a bundle.
pub const FIGURES_FILE: &str = "refinement.json";

/// What steps on a recording leave behind.
pub struct RefinedBundle {
    pub network: Network,
    /// Samples seen and seconds spent by all steps.
    pub samples: u64,
    pub seconds: f64,
    /// Files for the bundle: figures, curves, plots.
    pub files: BTreeMap<String, Vec<u8>>,
    /// The table of figures, as text for people and in the card.
    pub table: String,
}

/// Trains the blocks of the steps of `plan` of the network of `bundle` on the recording in `folder`.
pub fn run(bundle: &ModelBundle, folder: &Path, plan: &Plan<'_>, device: &Device) -> Result<RefinedBundle> {
    let recording = Recording::open(folder).blame("recording", folder)?;
    let canonical = training_camera();
    let mut network = bundle.network().clone();
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
    println!(
        "{kind}: {} frames to train on, {} held out at its end, {} in which nothing was found",
        frames.training.len(),
        frames.held_out.len(),
        frames.left_out
    );
    println!("{}", colors_line(&frames.colors));
    let set = TuningSet {
        frames: &frames,
        template: bundle.template(),
        canonical: &canonical,
        truth: &truth,
    };
    let mut rows = Vec::new();
    let mut refined = RefinedBundle {
        network: network.clone(),
        samples: 0,
        seconds: 0.0,
        files: BTreeMap::new(),
        table: String::new(),
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
        let bar = progress::share();
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
        refined.add(step, &done.state)?;
        network = done.network;
    }
    if let Some(exact) = RecordingMetrics::of_truth(set)? {
        rows.push(("the truth itself".to_owned(), exact));
    }
    refined.network = network;
    refined.table = table(kind, recording.frames(), frames.held_out.len(), &rows);
    refined
        .files
        .insert(FIGURES_FILE.to_owned(), figures(kind, &frames, &rows)?);
    Ok(refined)
}

impl RefinedBundle {
    fn add(&mut self, step: TuningStep, state: &Checkpoint) -> Result<()> {
        self.samples += state.samples;
        self.seconds += state.seconds;
        let name = |ending: &str| format!("step-{}.{ending}", step.number());
        self.files
            .insert(name("csv"), model_card::curve_csv(&state.curve).into_bytes());
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
    let description = dataset::open(&truth)?;
    let mut samples = BTreeMap::new();
    for (index, sample) in dataset::samples(&truth, &description, training_camera()).enumerate() {
        let sample = sample?;
        if frames.held_out.iter().any(|frame| frame.index == index) {
            samples.insert(index, sample);
        }
    }
    Ok(samples)
}

/// Figure of a row, means and medians.
type Figure = fn(&RecordingMetrics) -> Option<MeanMedian>;

/// The figures by their names, with their digits.
const FIGURES: [(&str, Figure, usize); 7] = [
    ("depth RMSE to the sensor, mm", |f| f.measured_depth_rmse_mm, 2),
    ("depth RMSE to the truth, mm", |f| f.depth_rmse_mm, 2),
    ("E_pr", |f| f.photometric_error, 4),
    ("E_pr, camera's colours", |f| f.recorded_colors_photometric_error, 4),
    ("E_pr, light fitted", |f| f.relit_photometric_error, 4),
    ("registration RMSE to the truth, px", |f| f.registration_rmse_px, 2),
    ("mask IoU", |f| f.mask_iou, 3),
];

/// The table of figures in Markdown; those that no frame has are left out.
fn table(kind: &str, all: usize, held_out: usize, rows: &[(String, RecordingMetrics)]) -> String {
    let known: Vec<_> = FIGURES
        .iter()
        .filter(|(_, figure, _)| rows.iter().any(|(_, row)| figure(row).is_some()))
        .collect();
    let mut table = format!("Held-out end of the {kind}: {held_out} of {all} frames, mean / median\n\n|");
    for (name, figure, _) in &known {
        let counted = rows.iter().find_map(|(_, row)| figure(row));
        table += &format!(" | {name} ({} frames)", counted.map_or(0, |counted| counted.frames));
    }
    table += &format!(" |\n|{}\n", "---|".repeat(known.len() + 1));
    for (name, row) in rows {
        table += &format!("| {name}");
        for (_, figure, digits) in &known {
            table += &figure(row).map_or_else(
                || " | -".to_owned(),
                |MeanMedian { mean, median, .. }| format!(" | {mean:.digits$} / {median:.digits$}"),
            );
        }
        table += " |\n";
    }
    if let Some((_, row)) = rows.first() {
        let pixels = row.measured_depth_pixels;
        table +=
            &format!("\nThe depth RMSE to the sensor is over {pixels} pixels of these frames, the same in every row\n");
    }
    table
}

/// The figures as JSON.
fn figures(kind: &str, frames: &RecordedFrames, rows: &[(String, RecordingMetrics)]) -> Result<Vec<u8>> {
    let rows: Vec<Value> = rows
        .iter()
        .map(|(name, row)| Ok(json!({"when": name, "figures": serde_json::to_value(row)?})))
        .collect::<Result<_>>()?;
    let value = json!({
        "recording": kind,
        "frames_trained_on": frames.training.len(),
        "frames_held_out": frames.held_out.len(),
        "colors": {"gain": frames.colors.gain, "offset": frames.colors.offset},
        "rows": rows,
    });
    serde_json::to_vec_pretty(&value).context("could not write the figures")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_table_leaves_out_what_a_recording_without_truth_does_not_know() {
        let row = |mean: f64| RecordingMetrics {
            measured_depth_rmse_mm: Some(MeanMedian {
                mean,
                median: 2.0,
                frames: 2,
            }),
            measured_depth_pixels: 4321,
            photometric_error: Some(MeanMedian {
                mean: 0.125,
                median: 0.1,
                frames: 1,
            }),
            ..RecordingMetrics::default()
        };
        let table = table(
            "recording",
            8,
            2,
            &[("before".to_owned(), row(12.5)), ("after step 2".to_owned(), row(9.0))],
        );
        let lines: Vec<&str> = table.lines().collect();
        assert_eq!(lines[0], "Held-out end of the recording: 2 of 8 frames, mean / median");
        assert_eq!(
            lines[2],
            "| | depth RMSE to the sensor, mm (2 frames) | E_pr (1 frames) |"
        );
        assert!(table.ends_with("to the sensor is over 4321 pixels of these frames, the same in every row\n"));
        assert_eq!(lines[4], "| before | 12.50 / 2.00 | 0.1250 / 0.1000 |");
        assert!(lines[5].starts_with("| after step 2 | 9.00"));
    }
}
