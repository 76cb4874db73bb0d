//! A training that is killed and resumed ends where an uninterrupted one does.

use crate::common::{alone, copy, small_compact, weights};
use burn::tensor::Device;
use deepsft::{Architecture, NetworkConfig, R50FConfig};
use deepsft_geometry::{Picture, Template, training_camera};
use deepsft_synth::{SynthConfig, Synthesizer};
use deepsft_train::{BatchShape, Budget, Progress, Schedule, TrainConfig, TrainError, train};
use std::path::Path;
use std::sync::Arc;

pub fn synthesizer() -> Arc<Synthesizer> {
    let texture = Picture::from_fn(90, 60, |x, y| {
        [(x * 7 % 256) as u8, (y * 11 % 256) as u8, ((x * y) % 256) as u8]
    });
    let template = Template::thin_shell(texture, 180.0, 120.0).unwrap();
    Arc::new(Synthesizer::new(&template, SynthConfig::default()).unwrap())
}

pub fn config(checkpoint: &Path, resume: bool) -> TrainConfig {
    let windows = BatchShape {
        frames: 2,
        width: 64,
        height: 64,
    };
    TrainConfig {
        budget: Budget::Samples(16),
        held_out_frames: 1,
        // Evaluate and save after every step.
        evaluate_every: 0.0,
        checkpoint: checkpoint.to_path_buf(),
        resume,
        schedule: Schedule {
            windows,
            frames: windows,
            warm_up: 2,
            ..Schedule::default()
        },
        ..TrainConfig::ours()
    }
}

/// A network with batch normalisation, whose running statistics must come back, too.
fn normalised() -> NetworkConfig {
    let shape = R50FConfig::narrow(32);
    NetworkConfig::new(Architecture::R50F(shape), [180.0, 120.0], &training_camera())
}

#[test]
fn a_resumed_training_gives_the_same_weights_and_curve_bit_for_bit() {
    let _alone = alone();
    for network in [small_compact(&training_camera()), normalised()] {
        resumed_as_uninterrupted(&network, config, 6);
    }
}

#[test]
fn a_training_that_is_resumed_where_its_windows_grow_has_the_same_batches() {
    let _alone = alone();
    let growing = |checkpoint: &Path, resume| {
        let mut config = config(checkpoint, resume);
        config.schedule.frames = BatchShape {
            frames: 1,
            width: 96,
            height: 64,
        };
        config.schedule.window_fraction = 0.5;
        // Batches are asked for ahead: these two workers have five under way.
        config.workers = 2;
        config
    };
    // Half of the 16 samples are seen in windows of 64 pixels.
    resumed_as_uninterrupted(&small_compact(&training_camera()), growing, 8);
}

/// Trains with the settings of `config` once to the end, and once on from a copy of the checkpoint after `samples` samples.
fn resumed_as_uninterrupted(network: &NetworkConfig, config: impl Fn(&Path, bool) -> TrainConfig, samples: u64) {
    let folder = tempfile::tempdir().unwrap();
    let (whole, half) = (folder.path().join("whole"), folder.path().join("half"));
    let device = Device::flex();
    let synthesizer = synthesizer();
    let uninterrupted = train(&synthesizer, network, &config(&whole, false), &device, |progress| {
        if let Progress::Evaluated(point) = progress
            && point.samples == samples
        {
            copy(&whole, &half);
        }
    })
    .unwrap();
    let mut resumed_at = 0;
    let resumed = train(&synthesizer, network, &config(&half, true), &device, |progress| {
        if let Progress::Resumed { samples, .. } = progress {
            resumed_at = samples;
        }
    })
    .unwrap();
    assert_eq!(resumed_at, samples);
    let curve = |state: &deepsft_train::Checkpoint| -> Vec<_> {
        // Everything but the wall clock; ten digits, since numbers go through JSON.
        state
            .curve
            .iter()
            .map(|p| {
                (
                    p.samples,
                    format!("{:.10e} {:.10e} {:?}", p.loss, p.learning_rate, p.mask_iou),
                )
            })
            .collect()
    };
    assert_eq!(curve(&resumed.state), curve(&uninterrupted.state));
    assert!(
        weights(&resumed.network) == weights(&uninterrupted.network),
        "the weights differ"
    );
}

#[test]
fn a_checkpoint_of_another_seed_is_refused_and_kept() {
    let _alone = alone();
    let folder = tempfile::tempdir().unwrap();
    let checkpoint = folder.path().join("checkpoint");
    let device = Device::flex();
    let mut first = config(&checkpoint, false);
    first.budget = Budget::Samples(2);
    train(
        &synthesizer(),
        &small_compact(&training_camera()),
        &first,
        &device,
        |_| {},
    )
    .unwrap();
    let second = TrainConfig {
        seed: 2,
        resume: true,
        ..first
    };
    let error = train(
        &synthesizer(),
        &small_compact(&training_camera()),
        &second,
        &device,
        |_| {},
    )
    .err()
    .unwrap();
    assert!(
        matches!(&error, TrainError::CheckpointMismatch { what, .. } if what == "seed"),
        "{error}"
    );
    assert!(checkpoint.join("network.bpk").is_file());
}

#[test]
fn a_checkpoint_is_gone_on_with_by_a_longer_training_of_the_same_kind_and_by_no_other() {
    let _alone = alone();
    let folder = tempfile::tempdir().unwrap();
    let mut begun = config(&folder.path().join("checkpoint"), true);
    begun.budget = Budget::Samples(2);
    let (ours, small) = (synthesizer(), small_compact(&training_camera()));
    let run = |source: &Arc<Synthesizer>, network: &NetworkConfig, config: &TrainConfig| {
        train(source, network, config, &Device::flex(), |_| {})
    };
    run(&ours, &small, &begun).unwrap();
    let refused =
        |source: &Arc<Synthesizer>, network: &NetworkConfig, config: &TrainConfig| match run(source, network, config)
            .err()
        {
            Some(TrainError::CheckpointMismatch { what, .. }) => what,
            other => panic!("{other:?}"),
        };
    let grey = Template::thin_shell(Picture::from_fn(90, 60, |_, _| [9; 3]), 180.0, 120.0).unwrap();
    let elsewhere = Arc::new(Synthesizer::new(&grey, SynthConfig::default()).unwrap());
    assert!(refused(&elsewhere, &small, &begun).contains("template"));
    assert_eq!(refused(&ours, &normalised(), &begun), "network");
    let changes: [fn(&mut TrainConfig); 4] = [
        |config| config.optimizer = TrainConfig::paper().optimizer,
        |config| config.schedule.peak *= 2.0,
        |config| config.schedule.windows.frames = 1,
        |config| config.average_decay = 0.0,
    ];
    for change in changes {
        let mut other = begun.clone();
        change(&mut other);
        assert!(refused(&ours, &small, &other).contains("preset"), "{other:?}");
    }
    let longer = TrainConfig {
        budget: Budget::Samples(4),
        evaluate_every: 1.0,
        workers: 5,
        ..begun
    };
    assert_eq!(run(&ours, &small, &longer).unwrap().state.samples, 4);
}

#[test]
fn a_truncated_checkpoint_is_refused_by_the_name_of_the_file() {
    let _alone = alone();
    let folder = tempfile::tempdir().unwrap();
    let checkpoint = folder.path().join("checkpoint");
    let device = Device::flex();
    let mut config = config(&checkpoint, true);
    config.budget = Budget::Samples(2);
    train(
        &synthesizer(),
        &small_compact(&training_camera()),
        &config,
        &device,
        |_| {},
    )
    .unwrap();
    let optimizer = checkpoint.join("optimizer.bpk");
    let bytes = std::fs::read(&optimizer).unwrap();
    std::fs::write(&optimizer, &bytes[..bytes.len() / 2]).unwrap();
    let error = train(
        &synthesizer(),
        &small_compact(&training_camera()),
        &config,
        &device,
        |_| {},
    )
    .err()
    .unwrap();
    assert!(error.to_string().contains("optimizer.bpk"), "{error}");
}
