//! `deepsft-lab study precision`: what a model says when its weights are rounded.

use anyhow::Result;
use clap::Args;
use deepsft::{Device, Estimator, FoldedNetwork, ModelBundle, WeightArray};
use deepsft_cli::input;
use deepsft_cli::synthesis::{self, SynthesisOptions};
use deepsft_formats::write_file;
use deepsft_train::{ACCURACY_SEED, Evaluation, EvaluationSummary};
use serde::Serialize;
use std::path::PathBuf;

#[derive(Args)]
pub struct PrecisionArguments {
    /// Model bundle whose weights are rounded
    #[arg(long, value_name = "BUNDLE", default_value = "models/poster-a4")]
    model: PathBuf,
    /// Held-out frames that are evaluated
    #[arg(long, value_name = "N", default_value_t = 160)]
    frames: u64,
    /// Write the figures to this file
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
}

/// How the filters are written; biases stay as they are.
#[derive(Clone, Copy)]
enum Rounding {
    /// As the bundle has them: in 8 bits, with a step for each filter.
    Kept,
    /// To integers of so many bits with a sign, in steps of their own for each filter.
    Filters(u32),
    /// The same with the same step for all filters of a layer.
    Layers(u32),
}

/// A row of the table.
#[derive(Serialize)]
struct Row {
    name: &'static str,
    /// Of the filters.
    megabytes: f64,
    #[serde(flatten)]
    summary: EvaluationSummary,
}

const ROUNDINGS: [(&str, Rounding); 5] = [
    ("as in the bundle, 8 bits", Rounding::Kept),
    ("8 bits, a step for each layer", Rounding::Layers(8)),
    ("6 bits, a step for each filter", Rounding::Filters(6)),
    ("5 bits, a step for each filter", Rounding::Filters(5)),
    ("4 bits, a step for each filter", Rounding::Filters(4)),
];

/// Evaluates the model on the same held-out frames with its weights rounded in several ways, and prints the table.
pub fn run(arguments: &PrecisionArguments) -> Result<()> {
    let bundle = input::bundle(&arguments.model)?;
    let synthesizer = synthesis::synthesizer(bundle.template(), &SynthesisOptions::default())?;
    let samples: Vec<_> = (0..arguments.frames)
        .map(|index| synthesizer.sample(ACCURACY_SEED, index))
        .collect();
    println!("filters                               MB  registration  depth      IoU    found  empty");
    let mut rows = Vec::new();
    for (name, rounding) in ROUNDINGS {
        let network = FoldedNetwork {
            weights: (bundle.network().weights.iter())
                .map(|(path, array)| (path.clone(), rounding.of(array)))
                .collect(),
            ..bundle.network().clone()
        };
        let (template, card) = (bundle.template().clone(), bundle.card().clone());
        let rounded = ModelBundle::new(network, template, *bundle.camera(), card);
        let estimator = Estimator::new(&rounded, &Device::Cpu)?;
        let frames = samples.iter().cloned();
        let evaluation = Evaluation::run(&estimator, None, bundle.template(), frames, |_, _, _, _| {})?;
        let row = Row {
            name,
            megabytes: rounding.bits() * filters(bundle.network()) as f64 / 8e6,
            summary: evaluation.summary(),
        };
        let number = |value: Option<f64>| value.unwrap_or(f64::NAN);
        println!(
            "{:34} {:5.2} {:10.3} px {:6.2} mm {:7.4} {:6.3} {:6.3}",
            row.name,
            row.megabytes,
            number(row.summary.median.registration_rmse_px),
            number(row.summary.median.depth_rmse_mm),
            number(row.summary.mean.mask_iou),
            number(row.summary.found_fraction),
            number(row.summary.empty_flagged_fraction),
        );
        rows.push(row);
    }
    if let Some(path) = &arguments.json {
        write_file(path, &serde_json::to_vec_pretty(&rows)?)?;
    }
    Ok(())
}

fn filters(network: &FoldedNetwork) -> usize {
    let filters = network.weights.values().filter(|array| array.shape.len() > 1);
    filters.map(|array| array.values.len()).sum()
}

impl Rounding {
    fn bits(self) -> f64 {
        match self {
            Self::Kept => 8.0,
            Self::Filters(bits) | Self::Layers(bits) => f64::from(bits),
        }
    }

    fn of(self, array: &WeightArray) -> WeightArray {
        let (bits, length) = match self {
            Self::Filters(bits) if array.shape.len() > 1 => (bits, array.values.len() / array.shape[0]),
            Self::Layers(bits) if array.shape.len() > 1 => (bits, array.values.len()),
            _ => return array.clone(),
        };
        let largest_integer = ((1_u32 << (bits - 1)) - 1) as f32;
        let mut array = array.clone();
        for filter in array.values.chunks_mut(length) {
            let largest = filter.iter().fold(0.0_f32, |most, value| most.max(value.abs()));
            let step = largest / largest_integer;
            if step > 0.0 {
                filter
                    .iter_mut()
                    .for_each(|value| *value = (*value / step).round() * step);
            }
        }
        array
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_filter_keeps_its_largest_weight_and_the_others_move_by_half_a_step_at_most() {
        let array = WeightArray {
            shape: vec![2, 3],
            values: vec![1.0, -0.3, 0.021, 100.0, -7.3, 0.0],
        };
        let rounded = Rounding::Filters(8).of(&array);
        for (k, (before, after)) in array.values.iter().zip(&rounded.values).enumerate() {
            let largest = [1.0, 100.0][k / 3];
            assert!(
                (before - after).abs() <= largest / 127.0 / 2.0 + 1e-6,
                "{before} {after}"
            );
            assert_eq!(before == after, k % 3 == 0 || *before == 0.0, "{before} {after}");
        }
        assert!(Rounding::Kept.of(&array) == array);
        let by_layer = Rounding::Layers(8).of(&array);
        assert_eq!(by_layer.values[2], 0.0, "less than half a step of the layer");
    }
}
