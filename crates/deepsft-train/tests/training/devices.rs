//! Several devices: the step they make together is that of one, is the same every time, and goes on after a stop.

use crate::common::{alone, copy, frame_of, plane, small_camera, small_compact, template, weights};
use burn::tensor::Device;
use deepsft::{Architecture, NetworkConfig, R50FConfig};
use deepsft_geometry::{ColorResponse, training_camera};
use deepsft_network::Network;
use deepsft_synth::{SynthConfig, Synthesizer};
use deepsft_train::{
    BatchShape, Budget, LearningRate, Optimizer, Progress, RecordedFrames, Schedule, TrainConfig, Trained,
    TrainingFrame, TuningSet, TuningSettings, TuningStep, train, tune,
};
use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;

/// A frame in which a part of the template is seen, the smaller the higher the index.
fn frame(index: usize) -> TrainingFrame {
    let mut frame = frame_of(index, &plane(0.01 * index as f32, [8 * index, 5 * index]));
    let inside = frame.inside.iter();
    (frame.depth_mm.iter_mut().zip(inside))
        .for_each(|(depth, &inside)| *depth += f32::from(inside) * 9.0 * index as f32);
    frame
}

/// `count` devices beside the first.
fn more(count: usize) -> Vec<Device> {
    vec![Device::flex(); count]
}

/// How far `a` and `b` lie apart, as a fraction of the way from `start` to `a`.
fn apart(start: &[f32], a: &[f32], b: &[f32]) -> f64 {
    let length = |x: &[f32], y: &[f32]| {
        let squares = x.iter().zip(y).map(|(x, y)| f64::from(x - y).powi(2));
        squares.sum::<f64>().sqrt()
    };
    let moved = length(start, a);
    assert!(moved > 0.0, "nothing was learnt");
    length(a, b) / moved
}

#[test]
fn a_step_of_steps_two_and_three_is_that_of_one_device_also_with_seven_frames_on_two() {
    let _alone = alone();
    let camera = small_camera();
    Device::flex().seed(5);
    let network = Network::new(&small_compact(&camera), &Device::flex()).fold();
    let frames = RecordedFrames {
        training: (0..7).map(frame).collect(),
        held_out: vec![frame(1)],
        left_out: 0,
        colors: ColorResponse::IDENTITY,
    };
    for step in [TuningStep::Depth, TuningStep::Registration] {
        let run = |devices: usize| {
            let folder = tempfile::tempdir().unwrap();
            let steps = TuningSettings {
                epochs: 1,
                batch: 7,
                // The weights move along the gradient itself.
                optimizer: Optimizer::Sgd { momentum: 0.0 },
                learning_rate: LearningRate {
                    initial: 1e-3,
                    decay: 0.0,
                },
                average_decay: 0.0,
            };
            let config = TrainConfig {
                checkpoint: folder.path().join("checkpoint"),
                depth_tuning: steps,
                registration_tuning: steps,
                more_devices: more(devices - 1),
                ..TrainConfig::ours()
            };
            let data = TuningSet {
                frames: &frames,
                template: &template(),
                canonical: &camera,
                truth: &BTreeMap::new(),
            };
            let mut losses = Vec::new();
            let tuned = tune(&network, step, data, &config, &Device::flex(), |told| {
                if let Progress::Step { loss, .. } = told {
                    losses.push(loss);
                }
            })
            .unwrap();
            assert_eq!(losses.len(), 1);
            (losses[0], weights(&tuned.network))
        };
        let start = weights(&network);
        let (loss, one) = run(1);
        for devices in [2, 3, 9] {
            let (shared_loss, shared) = run(devices);
            assert!(
                (shared_loss / loss - 1.0).abs() < 1e-5,
                "{step:?}: {shared_loss} and {loss}"
            );
            let apart = apart(&start, &one, &shared);
            println!("{step:?} on {devices}: {apart:.1e} of the step");
            assert!(apart < 1e-4, "{step:?} on {devices}: {apart}");
            assert!(shared == run(devices).1, "{step:?}: two runs differ");
        }
    }
}

/// A run of step 1 up to `samples`, from the checkpoint in `folder` if there is one.
fn step_one(
    network: &NetworkConfig,
    folder: &Path,
    devices: usize,
    samples: u64,
    epoch_samples: Option<u64>,
    report: impl FnMut(Progress),
) -> Trained {
    let synthesizer = Arc::new(Synthesizer::new(&template(), SynthConfig::default()).unwrap());
    let windows = BatchShape {
        frames: 5,
        width: 64,
        height: 64,
    };
    let schedule = match network.architecture {
        Architecture::Compact(_) => Schedule {
            windows,
            frames: windows,
            ..Schedule::constant(1e-2, 5)
        },
        _ => Schedule::constant(1e-2, 2),
    };
    let config = TrainConfig {
        budget: Budget::Samples(samples),
        held_out_frames: 1,
        // A checkpoint after every step.
        evaluate_every: 0.0,
        checkpoint: folder.to_path_buf(),
        resume: true,
        optimizer: Optimizer::Sgd { momentum: 0.0 },
        schedule,
        epoch_samples,
        average_decay: 0.0,
        more_devices: more(devices - 1),
        ..TrainConfig::ours()
    };
    train(&synthesizer, network, &config, &Device::flex(), report).unwrap()
}

/// A narrow network with batch normalisation.
fn normalised() -> NetworkConfig {
    // Sixteen neurons: fewer may all be silent at first.
    let shape = R50FConfig {
        neurons: 512,
        ..R50FConfig::narrow(32)
    };
    NetworkConfig::new(Architecture::R50F(shape), [180.0, 120.0], &training_camera())
}

#[test]
fn a_step_of_step_one_is_that_of_one_device() {
    let _alone = alone();
    // Batch normalisation sees each part alone. Where both parts are the same sample, that is the same again.
    for (network, batch, epoch_samples) in [(small_compact(&training_camera()), 5, None), (normalised(), 2, Some(1))] {
        let folder = tempfile::tempdir().unwrap();
        let start = folder.path().join("start");
        let before = weights(&step_one(&network, &start, 1, batch, epoch_samples, |_| {}).network);
        let go_on = |devices: usize| {
            let folder = folder.path().join(devices.to_string());
            copy(&start, &folder);
            let mut losses = Vec::new();
            let trained = step_one(&network, &folder, devices, 2 * batch, epoch_samples, |told| {
                if let Progress::Step { loss, .. } = told {
                    losses.push(loss);
                }
            });
            assert_eq!(losses.len(), 1);
            (losses[0], weights(&trained.network))
        };
        let (loss, one) = go_on(1);
        let (shared_loss, shared) = go_on(2);
        let name = network.architecture.name();
        assert!(
            (shared_loss / loss - 1.0).abs() < 1e-5,
            "{name}: {shared_loss} and {loss}"
        );
        let apart = apart(&before, &one, &shared);
        println!("{name}: {apart:.1e} of the step");
        assert!(apart < 1e-3, "{name}: {apart}");
    }
}

#[test]
fn two_devices_give_the_same_weights_again_and_after_a_stop() {
    let _alone = alone();
    for (network, batch) in [(small_compact(&training_camera()), 5), (normalised(), 2)] {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        step_one(&network, &at("start"), 1, batch, None, |_| {});
        copy(&at("start"), &at("again"));
        let whole = step_one(&network, &at("start"), 2, 4 * batch, None, |told| {
            if let Progress::Evaluated(point) = told
                && point.samples == 2 * batch
            {
                copy(&at("start"), &at("half"));
            }
        });
        let again = step_one(&network, &at("again"), 2, 4 * batch, None, |_| {});
        assert!(weights(&whole.network) == weights(&again.network), "two runs differ");
        let mut resumed_at = 0;
        let resumed = step_one(&network, &at("half"), 2, 4 * batch, None, |told| {
            if let Progress::Resumed { samples, .. } = told {
                resumed_at = samples;
            }
        });
        assert_eq!(resumed_at, 2 * batch);
        assert!(
            weights(&whole.network) == weights(&resumed.network),
            "a resumed run differs"
        );
    }
}
