//! Checkpoints of trainings.

use crate::files::{join, parts, patched, with_folder};
use crate::{picture, weights};
use anyhow::{Context, Result};
use burn::module::Module;
use burn::optim::{GradientsParams, ModuleOptimizer};
use deepsft::NetworkConfig;
use deepsft_network::{Network, pictures_to_tensor};
use deepsft_train::{Checkpoint, CheckpointFolder, CurvePoint, Device, Fingerprint, Optimizer};
use std::fs;
use std::sync::LazyLock;

/// A checkpoint's files, the average of the weights last.
const FILES: [&str; 4] = ["state.json", "network.bpk", "optimizer.bpk", "average.bpk"];

/// The optimiser of the training.
const OPTIMIZER: Optimizer = Optimizer::Adam { betas: [0.9, 0.999] };

/// The files are those of a checkpoint, as they are or as changes of one that was saved.
pub(crate) fn read(input: &[u8]) -> Result<()> {
    let files = parts::<4>(input).into_iter().zip(saved()?);
    let files = files.map(|(part, whole)| patched(&part, whole));
    let names = FILES.map(|name| format!("checkpoint/{name}"));
    with_folder(names.into_iter().zip(files), |folder| {
        let checkpoint = CheckpointFolder::new(folder.join("checkpoint"));
        let state = checkpoint.state()?.context("there is no checkpoint")?;
        let config = weights::small_config()?;
        let make = || Ok(Network::new(&config, &Device::flex()));
        let loaded = checkpoint.load(make, OPTIMIZER.init(), &state.fingerprint, state.seed)?;
        let loaded = loaded.context("a checkpoint has a state and nothing else")?;
        assert_eq!(loaded.state.samples, state.samples);
        Ok(())
    })
}

/// The files of a checkpoint of the smallest network.
fn saved() -> Result<&'static [Vec<u8>; 4]> {
    static FILES: LazyLock<Option<[Vec<u8>; 4]>> = LazyLock::new(|| save().ok());
    FILES.as_ref().context("no checkpoint can be saved")
}

fn save() -> Result<[Vec<u8>; 4]> {
    let folder = tempfile::tempdir()?;
    let place = folder.path().join("checkpoint");
    let config = weights::small_config()?;
    let (network, optimizer) = trained(&config);
    let state = Checkpoint {
        step: 3,
        samples: 12,
        seconds: 1.5,
        fingerprint: Fingerprint::default().with("network", &config),
        seed: 7,
        curve: vec![CurvePoint {
            samples: 12,
            loss: f64::NAN,
            depth_rmse_mm: Some(1.0),
            ..CurvePoint::default()
        }],
    };
    CheckpointFolder::new(&place).save(&state, &network, Some(&network), &optimizer)?;
    let [state, network, optimizer, average] = FILES.map(|name| fs::read(place.join(name)));
    Ok([state?, network?, optimizer?, average?])
}

/// A network after one update, and its optimiser, which has a state then.
fn trained(config: &NetworkConfig) -> (Network, ModuleOptimizer) {
    let device = Device::flex().autodiff();
    let network = Network::new(config, &device);
    let maps = network.forward_maps(pictures_to_tensor(&[&picture::small(32, 32)], &device));
    let loss = maps.depth.sum() + maps.registration.sum() + maps.mask_logits.sum();
    let gradients = GradientsParams::from_grads(loss.backward(), &network);
    let mut optimizer = OPTIMIZER.init();
    let network = optimizer.step(1e-3, network, gradients);
    (network.valid(), optimizer)
}

pub(crate) fn seeds() -> Result<Vec<Vec<u8>>> {
    let [state, ..] = saved()?;
    Ok(vec![
        join(&[b"~", b"~", b"~", b"~"]),
        // Other weights: of the network, of its average, and other sums of the optimiser.
        join(&[state, b"~\xff\xf0\x00\x07", b"~"]),
        join(&[state, b"~", b"~\xff\xf0\x00\x07", b"~\xff\xf0\x00\x07"]),
    ])
}
