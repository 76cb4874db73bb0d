//! Mixed precision: training learns as in single precision, skips what overflows, and goes on after a stop.

use crate::common::{alone, copy, frame_of, plane, small_camera, small_compact, template, weights};
use burn::module::{Module, ModuleMapper, Param};
use burn::tensor::{Device, Tensor};
use deepsft::{Architecture, NetworkConfig, R50FConfig};
use deepsft_geometry::{ColorResponse, training_camera};
use deepsft_network::Network;
use deepsft_synth::{SynthConfig, Synthesizer};
use deepsft_train::{
    BatchShape, Budget, LearningRate, LossScale, Optimizer, Precision, Progress, RecordedFrames, Schedule, TrainConfig,
    Trained, TuningSet, TuningSettings, TuningStep, train, tune,
};
use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;

/// A narrow network with batch normalisation.
fn normalised() -> NetworkConfig {
    // Eight neurons: fewer may all be silent at first.
    let shape = R50FConfig {
        neurons: 256,
        ..R50FConfig::narrow(32)
    };
    NetworkConfig::new(Architecture::R50F(shape), [180.0, 120.0], &training_camera())
}

/// Seconds between checkpoints of a run that ends before.
const RARELY: f64 = 1e9;

/// What a run told.
#[derive(Default)]
struct Told {
    losses: Vec<f64>,
    skipped: Vec<LossScale>,
}

impl Told {
    fn hear(&mut self, told: &Progress) {
        match told {
            Progress::Step { loss, .. } => self.losses.push(*loss),
            Progress::Skipped { scale, .. } => self.skipped.push(*scale),
            _ => {}
        }
    }
}

/// A run of step 1 on one sample, up to `steps` steps, from the checkpoint in `folder` if there is one, with another
/// one every so many seconds.
fn step_one(
    network: &NetworkConfig,
    precision: Precision,
    folder: &Path,
    steps: u64,
    every: f64,
    mut report: impl FnMut(&Progress),
) -> (Trained, Told) {
    // Upright sheets: the tolerances were measured on them.
    let mut images = SynthConfig::default();
    images.pose.max_roll_deg = 45.0;
    let synthesizer = Arc::new(Synthesizer::new(&template(), images).unwrap());
    let windows = BatchShape {
        frames: 2,
        width: 96,
        height: 96,
    };
    let schedule = match network.architecture {
        Architecture::Compact(_) => Schedule {
            windows,
            frames: windows,
            ..Schedule::constant(2e-3, 2)
        },
        _ => Schedule::constant(3e-4, 2),
    };
    let config = TrainConfig {
        seed: 3,
        budget: Budget::Samples(2 * steps),
        held_out_frames: 1,
        evaluate_every: every,
        checkpoint: folder.to_path_buf(),
        resume: true,
        optimizer: Optimizer::Adam { betas: [0.9, 0.999] },
        schedule,
        epoch_samples: Some(1),
        average_decay: 0.0,
        precision,
        ..TrainConfig::ours()
    };
    let mut told = Told::default();
    let trained = train(&synthesizer, network, &config, &Device::flex(), |progress| {
        told.hear(&progress);
        report(&progress);
    });
    (trained.unwrap(), told)
}

/// Largest difference of two courses of the loss, as a fraction of the first loss.
fn apart(a: &[f64], b: &[f64]) -> f64 {
    assert_eq!(a.len(), b.len());
    a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max) / a[0]
}

/// How far a loss may be from single precision's at any step, as a fraction of the first. Steps of Adam magnify rounding:
/// runs from weights that differ by millionths are up to 0.06 apart.
const TOLERANCE: f64 = 0.15;

#[test]
fn step_one_in_half_precision_learns_as_in_single_precision() {
    let _alone = alone();
    for (network, steps) in [(small_compact(&training_camera()), 30), (normalised(), 6)] {
        let folder = tempfile::tempdir().unwrap();
        let start = folder.path().join("start");
        step_one(&network, Precision::F32, &start, 1, RARELY, |_| {});
        let go_on = |precision: Precision| {
            let folder = folder.path().join(precision.name());
            copy(&start, &folder);
            // From the first step on no gradient overflows.
            if precision == Precision::F16 {
                let scale = 1024.0;
                inject(
                    &folder,
                    LossScale {
                        scale,
                        ..LossScale::new(precision)
                    },
                );
            }
            step_one(&network, precision, &folder, 1 + steps, RARELY, |_| {})
        };
        let (_, single) = go_on(Precision::F32);
        let name = network.architecture.name();
        for precision in [Precision::F16, Precision::BF16] {
            let (trained, half) = go_on(precision);
            let (first, last) = (half.losses[0], half.losses[half.losses.len() - 1]);
            let apart = apart(&single.losses, &half.losses);
            println!("{name} {precision}: {first:.4} -> {last:.4}, {apart:.1e} from single precision");
            assert!(
                half.skipped.is_empty() && last < 0.98 * first,
                "{precision}: {first} -> {last}"
            );
            assert!(apart > 0.0 && apart < TOLERANCE, "{name} {precision}: {apart}");
            let scale = trained.state.loss_scale.unwrap();
            assert_eq!((scale.precision, scale.skipped_steps), (precision, 0));
        }
        assert!(
            step_one(&network, Precision::F32, &start, 1, RARELY, |_| {})
                .0
                .state
                .loss_scale
                .is_none()
        );
    }
}

#[test]
fn steps_two_and_three_in_half_precision_learn_as_in_single_precision() {
    let _alone = alone();
    let camera = small_camera();
    Device::flex().seed(5);
    let network = Network::new(&small_compact(&camera), &Device::flex()).fold();
    let frames = RecordedFrames {
        training: (0..3)
            .map(|index| frame_of(index, &plane(0.02 * index as f32, [0; 2])))
            .collect(),
        held_out: vec![frame_of(1, &plane(0.02, [0; 2]))],
        left_out: 0,
        colors: ColorResponse::IDENTITY,
    };
    for step in [TuningStep::Depth, TuningStep::Registration] {
        let run = |precision: Precision| {
            let folder = tempfile::tempdir().unwrap();
            let steps = TuningSettings {
                epochs: 40,
                batch: 3,
                optimizer: Optimizer::Adam { betas: [0.9, 0.999] },
                learning_rate: LearningRate {
                    initial: 3e-3,
                    decay: 0.0,
                },
                average_decay: 0.0,
            };
            let config = TrainConfig {
                checkpoint: folder.path().join("checkpoint"),
                depth_tuning: steps,
                registration_tuning: steps,
                precision,
                // Half precision and two devices at once.
                more_devices: vec![Device::flex()],
                ..TrainConfig::ours()
            };
            let data = TuningSet {
                frames: &frames,
                template: &template(),
                canonical: &camera,
                truth: &BTreeMap::new(),
            };
            let mut told = Told::default();
            tune(&network, step, data, &config, &Device::flex(), |progress| {
                told.hear(&progress);
            })
            .unwrap();
            told.losses
        };
        let single = run(Precision::F32);
        for precision in [Precision::F16, Precision::BF16] {
            // Steps that are skipped at first leave the weights alone, and every step sees all three frames.
            let half = run(precision);
            assert!(half.len() > 30, "{}", half.len());
            let (first, last) = (half[0], half[half.len() - 1]);
            let apart = apart(&single[..half.len()], &half);
            println!("{step:?} {precision}: {first:.4} -> {last:.4}, {apart:.1e} from single precision");
            assert!(last < 0.3 * first, "{step:?} {precision}: {first} -> {last}");
            assert!(apart < TOLERANCE, "{step:?} {precision}: {apart}");
        }
    }
}

/// Writes another loss scale into a checkpoint.
fn inject(folder: &Path, scale: LossScale) {
    let path = folder.join("state.json");
    let mut state: serde_json::Value = serde_json::from_slice(&std::fs::read(&path).unwrap()).unwrap();
    state["loss_scale"] = serde_json::to_value(scale).unwrap();
    std::fs::write(&path, serde_json::to_vec(&state).unwrap()).unwrap();
}

/// Makes the second convolution of the depth refinement a million times as large: half precision ends at 65,504.
#[derive(Default)]
struct Enlarged(Vec<String>);

impl ModuleMapper for Enlarged {
    fn enter_module(&mut self, name: &str, _container: &str) {
        self.0.push(name.to_owned());
    }

    fn exit_module(&mut self, _name: &str, _container: &str) {
        self.0.pop();
    }

    fn map_float<const D: usize>(&mut self, param: Param<Tensor<D>>) -> Param<Tensor<D>> {
        if self.0.join(".").starts_with("depth_refinement.middle") {
            return param.map(|values| values * 1e6);
        }
        param
    }
}

#[test]
fn the_curve_has_no_loss_where_every_step_overflowed() {
    let _alone = alone();
    let camera = small_camera();
    Device::flex().seed(5);
    let network = Network::new(&small_compact(&camera), &Device::flex()).fold();
    let network = network.map(&mut Enlarged::default());
    let frames = RecordedFrames {
        training: vec![frame_of(0, &plane(0.0, [0; 2]))],
        held_out: vec![frame_of(1, &plane(0.02, [0; 2]))],
        left_out: 0,
        colors: ColorResponse::IDENTITY,
    };
    let folder = tempfile::tempdir().unwrap();
    let mut config = TrainConfig {
        checkpoint: folder.path().join("checkpoint"),
        precision: Precision::F16,
        ..TrainConfig::ours()
    };
    config.depth_tuning.epochs = 2;
    let run = |config: &TrainConfig| {
        let data = TuningSet {
            frames: &frames,
            template: &template(),
            canonical: &camera,
            truth: &BTreeMap::new(),
        };
        let mut told = Told::default();
        let tuned = tune(&network, TuningStep::Depth, data, config, &Device::flex(), |progress| {
            told.hear(&progress);
        });
        (tuned.unwrap(), told)
    };
    let (tuned, told) = run(&config);
    assert_eq!((told.losses.len(), told.skipped.len()), (0, 2));
    // Before the first epoch, and after each.
    assert_eq!(tuned.state.curve.len(), 3);
    assert!(tuned.state.curve.iter().all(|point| point.loss.is_nan()));
    // Such a checkpoint can be gone on from.
    config.resume = true;
    config.depth_tuning.epochs = 3;
    let (tuned, told) = run(&config);
    assert_eq!((tuned.state.curve.len(), told.skipped.len()), (4, 1));
    assert!(tuned.state.curve[..3].iter().all(|point| point.loss.is_nan()));
}

#[test]
fn a_step_that_overflows_is_not_made_and_halves_the_scale_and_a_stopped_run_goes_on_with_it() {
    const STEPS: u64 = 22;
    let _alone = alone();
    for network in [small_compact(&training_camera()), normalised()] {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        let precision = Precision::F16;
        step_one(&network, Precision::F32, &at("start"), 1, RARELY, |_| {});
        // No gradient of half precision is finite with this.
        let huge = LossScale {
            scale: 2.0_f64.powi(60),
            ..LossScale::new(precision)
        };
        inject(&at("start"), huge);
        copy(&at("start"), &at("once"));
        let (once, told) = step_one(&network, precision, &at("once"), 2, RARELY, |_| {});
        assert_eq!((told.losses.len(), told.skipped.len()), (0, 1));
        assert_eq!(told.skipped[0].scale, 2.0_f64.powi(59));
        assert_eq!(told.skipped[0].skipped_steps, 1);
        assert_eq!((once.state.step, once.state.samples), (1, 4));
        // Neither weights nor running statistics moved: both are in the folded network.
        let (start, _) = step_one(&network, Precision::F32, &at("start"), 1, RARELY, |_| {});
        assert!(weights(&once.network) == weights(&start.network));
        if network.as_compact().is_none() {
            // What follows is the same for all, and slow for this one.
            continue;
        }
        // A scale from which it finds back within some steps.
        let large = LossScale {
            scale: 2.0_f64.powi(30),
            ..huge
        };
        inject(&at("start"), large);
        let (whole, told) = step_one(&network, precision, &at("start"), STEPS, 0.0, |progress| {
            if let Progress::Evaluated(point) = progress
                && point.samples == 6
            {
                copy(&at("start"), &at("half"));
            }
        });
        let skipped = told.skipped.len();
        println!("{}: {skipped} steps skipped", network.architecture.name());
        assert!((3..=19).contains(&skipped), "{skipped}");
        assert_eq!((told.losses.len() + skipped) as u64, STEPS - 1);
        let scale = whole.state.loss_scale.unwrap();
        assert_eq!(scale.skipped_steps as usize, skipped);
        assert_eq!(scale.scale, 2.0_f64.powi(30 - skipped as i32));
        assert_eq!(whole.state.step as usize, 1 + told.losses.len());
        assert!(told.losses.iter().all(|loss| loss.is_finite()));
        // Stopped among the skipped steps.
        let (resumed, rest) = step_one(&network, precision, &at("half"), STEPS, RARELY, |_| {});
        assert_eq!(rest.skipped.len(), skipped - 2);
        assert_eq!(rest.losses, told.losses);
        assert_eq!(resumed.state.loss_scale, whole.state.loss_scale);
    }
}
