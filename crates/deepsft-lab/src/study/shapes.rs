//! `deepsft-lab study shapes`: what a compact network of other sides costs and says after the same training.

use crate::measuring::{Times, timed};
use anyhow::{Context, Result};
use clap::Args;
use deepsft::{Architecture, CompactConfig, DeviceKind, MODEL_FILE, ModelBundle, NetworkConfig, WEIGHTS_FILE};
use deepsft_cli::synthesis::{self, SynthesisOptions};
use deepsft_cli::{input, progress};
use deepsft_formats::{FolderKind, write_file, write_folder};
use deepsft_geometry::{CANONICAL_HEIGHT, CANONICAL_WIDTH, Picture};
use deepsft_network::{Network, start_device};
use deepsft_train::{Budget, ModelLabel, Progress, TrainConfig, export_bundle, train};
use serde::Serialize;
use std::path::PathBuf;
use std::sync::Arc;

const BUNDLE_FOLDER: FolderKind = FolderKind {
    known_by: &[MODEL_FILE],
    files: &[
        MODEL_FILE,
        WEIGHTS_FILE,
        "template/template.json",
        "template/texture.png",
        "template/mesh.obj",
    ],
};

/// Turns of every network in which its time is taken.
const TURNS: usize = 25;

#[derive(Args)]
pub struct ShapesArguments {
    /// Model bundle whose template is trained for
    #[arg(long, value_name = "BUNDLE", default_value = "models/poster-a4")]
    model: PathBuf,
    /// Samples that each network is trained on
    #[arg(long, value_name = "N", default_value_t = 10_000)]
    samples: u64,
    /// Folder for the bundles, their checkpoints and the table; a stopped study goes on from it
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
}

/// A row of the table.
#[derive(Serialize)]
struct Row {
    name: &'static str,
    shape: CompactConfig,
    parameters: usize,
    gflop: f64,
    weights_bytes: usize,
    registration_px: Option<f64>,
    depth_mm: Option<f64>,
    mask_iou: Option<f64>,
    median_ms: f64,
}

/// The shapes that are compared, the one that ships first.
fn candidates() -> Vec<(&'static str, CompactConfig)> {
    let shipped = CompactConfig::default;
    vec![
        ("shipped", shipped()),
        (
            "one-block",
            CompactConfig {
                blocks_at_32: 1,
                ..shipped()
            },
        ),
        (
            "narrow-32",
            CompactConfig {
                channels: [32, 48, 96, 128],
                ..shipped()
            },
        ),
        (
            "narrow",
            CompactConfig {
                channels: [24, 40, 80, 128],
                ..shipped()
            },
        ),
        (
            "wide-8",
            CompactConfig {
                channels: [32, 64, 96, 128],
                blocks_at_32: 1,
                ..shipped()
            },
        ),
    ]
}

/// Trains each candidate on the same samples, measures it on the same held-out frames, takes the times in turns on one thread, and
/// prints the table.
pub fn run(arguments: &ShapesArguments) -> Result<()> {
    let teacher = input::bundle(&arguments.model)?;
    std::fs::create_dir_all(&arguments.out)?;
    let mut bundles = Vec::new();
    for (name, shape) in candidates() {
        println!("{name}");
        bundles.push((name, trained(arguments, &teacher, name, shape)?));
    }
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build()?;
    let rows = pool.install(|| rows(&bundles))?;
    println!("network    parameters  GFLOP  download  registration  depth    IoU     one thread");
    for row in &rows {
        println!(
            "{:10} {:10} {:6.2} {:6.2} MB {:10.2} px {:5.1} mm {:6.3} {:8.2} ms",
            row.name,
            row.parameters,
            row.gflop,
            row.weights_bytes as f64 / 1e6,
            row.registration_px.unwrap_or(f64::NAN),
            row.depth_mm.unwrap_or(f64::NAN),
            row.mask_iou.unwrap_or(f64::NAN),
            row.median_ms,
        );
    }
    write_file(&arguments.out.join("shapes.json"), &serde_json::to_vec_pretty(&rows)?)?;
    Ok(())
}

/// The bundle of a candidate: read if an earlier run made it.
fn trained(
    arguments: &ShapesArguments,
    teacher: &ModelBundle,
    name: &str,
    shape: CompactConfig,
) -> Result<ModelBundle> {
    let folder = arguments.out.join(name);
    if folder.join(MODEL_FILE).exists() {
        return input::bundle(&folder);
    }
    let config = TrainConfig {
        checkpoint: arguments.out.join(format!("{name}.checkpoint")),
        resume: true,
        budget: Budget::Samples(arguments.samples),
        workers: 1,
        evaluate_every: 600.0,
        ..TrainConfig::ours()
    };
    let template = teacher.template();
    let network = NetworkConfig::new(
        Architecture::Compact(shape),
        template.size_mm().to_array(),
        teacher.camera(),
    );
    let synthesizer = Arc::new(synthesis::synthesizer(template, &SynthesisOptions::default())?);
    let (device, _) = pollster::block_on(start_device(DeviceKind::Cpu))?;
    let bar = progress::fraction();
    let trained = train(&synthesizer, &network, &config, &device, |told| {
        if let Progress::Step { samples, .. } = told {
            bar.set_position(bar.length().unwrap_or_default() * samples / arguments.samples.max(1));
        }
    })?;
    bar.finish_and_clear();
    let label = ModelLabel {
        name: name.to_owned(),
        licence: None,
        command: "deepsft-lab study shapes".to_owned(),
    };
    let bundle = export_bundle(trained, &synthesizer, &config, label)?;
    write_folder(&folder, &BUNDLE_FOLDER, &bundle.to_files()?)?;
    Ok(bundle)
}

fn rows(bundles: &[(&'static str, ModelBundle)]) -> Result<Vec<Row>> {
    let image = Picture::from_fn(CANONICAL_WIDTH, CANONICAL_HEIGHT, |x, y| {
        [(x % 256) as u8, (y % 256) as u8, (x * y % 251) as u8]
    });
    let mut executors = Vec::new();
    for (_, bundle) in bundles {
        let executor = bundle.network().executor((CANONICAL_WIDTH, CANONICAL_HEIGHT))?;
        executors.push((executor, Vec::new()));
    }
    for turn in 0..=TURNS {
        for (executor, times) in &mut executors {
            let mut ms = 0.0;
            timed(&mut ms, || executor.run(&image))?;
            // The first turn fills caches.
            if turn > 0 {
                times.push(ms);
            }
        }
    }
    let (device, _) = pollster::block_on(start_device(DeviceKind::Cpu))?;
    let mut rows = Vec::new();
    for ((name, bundle), (_, times)) in bundles.iter().zip(executors) {
        let network = bundle.network();
        let layers = Network::from_folded(network, &device)?.describe();
        let accuracy = &bundle.card().accuracy;
        rows.push(Row {
            name,
            shape: network.config.as_compact().context("a compact network")?.clone(),
            parameters: network.parameters(),
            gflop: layers.iter().map(|layer| layer.executed_flops).sum::<u64>() as f64 / 1e9,
            weights_bytes: bundle.to_files()?.get(WEIGHTS_FILE).map_or(0, Vec::len),
            registration_px: accuracy.registration_rmse_px,
            depth_mm: accuracy.depth_rmse_mm,
            mask_iou: accuracy.mask_iou,
            median_ms: Times::of(times).context("nothing was measured")?.median_ms,
        });
    }
    Ok(rows)
}

#[cfg(test)]
mod tests {
    use super::*;
    use deepsft_geometry::training_camera;

    #[test]
    fn every_candidate_can_be_made_and_the_first_is_the_one_that_ships() {
        let candidates = candidates();
        assert_eq!(candidates[0].1, CompactConfig::default());
        for (name, shape) in candidates {
            let network = NetworkConfig::new(Architecture::Compact(shape), [297.0, 210.0], &training_camera());
            network.check().unwrap_or_else(|reason| panic!("{name}: {reason}"));
        }
    }
}
