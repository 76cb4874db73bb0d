//! Several devices: the step they make together is that of one, is the same every time, and goes on after a stop.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use burn::module::{Module, ModuleVisitor, Param};
use burn::tensor::{Device, Tensor};
use deepsft::{Architecture, CompactConfig, Network, NetworkConfig, R50FConfig};
use deepsft_geometry::{Camera, Maps, Picture, Template, draw_template, training_camera};
use deepsft_synth::{SynthConfig, Synthesizer};
use deepsft_train::{
    BatchShape, Budget, LearningRate, Optimizer, Progress, RecordedFrames, RefinementData, RefinementStep,
    RefinementSteps, Schedule, TrainConfig, Trained, TrainingFrame, refine, train,
};
use std::collections::BTreeMap;
use std::path::Path;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// burn's random numbers are one stream for all threads: a test at a time, so that each starts from the same weights.
fn alone() -> MutexGuard<'static, ()> {
    static ALONE: Mutex<()> = Mutex::new(());
    ALONE.lock().unwrap_or_else(PoisonError::into_inner)
}

const SIZE: [usize; 2] = [96, 64];

/// A texture whose red tells u and whose green tells v.
fn template() -> Template {
    let texture = Picture::from_fn(90, 60, |x, y| [(20 + 2 * x) as u8, (20 + 3 * y) as u8, 128]);
    Template::thin_shell(texture, 180.0, 120.0).unwrap()
}

fn compact(camera: &Camera) -> NetworkConfig {
    let shape = CompactConfig {
        channels: [8, 8, 8, 8],
        blocks_at_32: 1,
        bins: [8, 8, 8],
        refinement_channels: 16,
        mask_channels: 8,
        seams: false,
    };
    NetworkConfig::new(Architecture::Compact(shape), [180.0, 120.0], camera)
}

/// `count` devices beside the first.
fn more(count: usize) -> Vec<Device> {
    vec![Device::flex(); count]
}

struct Weights(Vec<f32>);

impl ModuleVisitor for Weights {
    fn visit_float<const D: usize>(&mut self, param: &Param<Tensor<D>>) {
        self.0.extend(param.val().into_data().try_to_vec::<f32>().unwrap());
    }
}

fn weights(network: &Network) -> Vec<f32> {
    let mut weights = Weights(Vec::new());
    network.visit(&mut weights);
    assert!(weights.0.len() > 1000, "the network's weights were not visited");
    weights.0
}

/// How far `a` and `b` lie apart, as a share of the way from `start` to `a`.
fn apart(start: &[f32], a: &[f32], b: &[f32]) -> f64 {
    let length = |x: &[f32], y: &[f32]| {
        let squares = x.iter().zip(y).map(|(x, y)| f64::from(x - y).powi(2));
        squares.sum::<f64>().sqrt()
    };
    let moved = length(start, a);
    assert!(moved > 0.0, "nothing was learnt");
    length(a, b) / moved
}

/// A frame in which a part of the template is seen, the smaller the higher the index.
fn frame(index: usize) -> TrainingFrame {
    let [width, height] = SIZE;
    let mut maps = Maps::empty(width, height);
    for y in 8..height - 8 - 5 * index {
        for x in 10..width - 10 - 8 * index {
            let uv = [0.2 + 0.01 * index as f32 + x as f32 / 200.0, 0.3 + y as f32 / 160.0];
            maps.set(y * width + x, 500.0 + x as f32 + 9.0 * index as f32, uv);
        }
    }
    TrainingFrame {
        index,
        image: draw_template(template().texture(), &maps),
        depth_mm: maps.depth().iter().map(|&depth| depth.max(0.0)).collect(),
        inside: maps.mask(),
        depth_counts: maps.mask(),
        level: 0,
    }
}

#[test]
fn a_step_of_steps_two_and_three_is_that_of_one_device_also_with_seven_frames_on_two() {
    let _alone = alone();
    let camera = training_camera().resized(SIZE[0] as u32, SIZE[1] as u32).unwrap();
    Device::flex().seed(5);
    let network = compact(&camera).init(&Device::flex()).fold();
    let frames = RecordedFrames {
        training: (0..7).map(frame).collect(),
        held_out: vec![frame(1)],
        left_out: 0,
    };
    for step in [RefinementStep::Depth, RefinementStep::Registration] {
        let run = |devices: usize| {
            let folder = tempfile::tempdir().unwrap();
            let steps = RefinementSteps {
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
                depth_steps: steps,
                registration_steps: steps,
                more_devices: more(devices - 1),
                ..TrainConfig::default()
            };
            let data = RefinementData {
                frames: &frames,
                template: &template(),
                canonical: &camera,
                truth: &BTreeMap::new(),
            };
            let mut losses = Vec::new();
            let refined = refine(&network, step, data, &config, &Device::flex(), |told| {
                if let Progress::Step { loss, .. } = told {
                    losses.push(loss);
                }
            })
            .unwrap();
            assert_eq!(losses.len(), 1);
            (losses[0], weights(&refined.network))
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
        ..TrainConfig::default()
    };
    train(&synthesizer, network, &config, &Device::flex(), report).unwrap()
}

/// Copies a checkpoint as a kill would leave it.
fn copy(from: &Path, to: &Path) {
    std::fs::create_dir_all(to).unwrap();
    for entry in std::fs::read_dir(from).unwrap() {
        let entry = entry.unwrap();
        std::fs::copy(entry.path(), to.join(entry.file_name())).unwrap();
    }
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
    // Batch normalisation sees each share alone. Where both shares are the same sample, that is the same again.
    for (network, batch, epoch_samples) in [(compact(&training_camera()), 5, None), (normalised(), 2, Some(1))] {
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
    for (network, batch) in [(compact(&training_camera()), 5), (normalised(), 2)] {
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
