//! Training steps 2 and 3: each learns a frame by heart, lowers the errors on frames it does not see, moves its own block
//! alone, and goes on where it was stopped.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

mod common;

use burn::module::{Module, ModuleVisitor, Param};
use burn::tensor::{Device, Tensor};
use common::charts::{in_texture, two_charts};
use common::{copy, frame_of, plane, small_camera, small_compact, template};
use deepsft::{Architecture, NetworkConfig, PaperConfig};
use deepsft_geometry::glam::DVec2;
use deepsft_geometry::{ColorResponse, Picture, Template, draw_template, photo_consistency_error, training_camera};
use deepsft_network::Network;
use deepsft_synth::{SynthConfig, Synthesizer};
use deepsft_train::{
    BatchShape, Budget, LearningRate, Light, MeanMedian, Optimizer, Progress, RecordedFrames, Residual, Schedule,
    TrainConfig, TrainError, TrainingFrame, Tuned, TuningSet, TuningSettings, TuningStep, set_aside_outdated, train,
    tune,
};
use std::collections::BTreeMap;
use std::path::Path;
use std::sync::{Arc, LazyLock, Mutex, PoisonError};

/// A small network with its first weights, another one, and one that says rest positions; all folded as in
/// bundles. They are drawn together when a test first asks for one, before any of these tests trains: the device's
/// generator is one for all threads.
static NETWORKS: LazyLock<Mutex<[Network; 3]>> = LazyLock::new(|| {
    let config = small_compact(&small_camera());
    let drawn = [
        (5, config.clone()),
        (6, config.clone()),
        (5, config.with_rest_positions(180.0)),
    ]
    .map(|(seed, config)| {
        let device = Device::flex();
        device.seed(seed);
        Network::new(&config, &device).fold()
    });
    Mutex::new(drawn)
});

fn drawn(number: usize) -> Network {
    NETWORKS.lock().unwrap_or_else(PoisonError::into_inner)[number].clone()
}

fn network() -> Network {
    drawn(0)
}

fn another_network() -> Network {
    drawn(1)
}

fn network_of_rest_positions() -> Network {
    drawn(2)
}

/// A frame in which a part of the template is seen, with the offset `shift` of the texture.
fn frame(index: usize, shift: f32) -> TrainingFrame {
    frame_of(index, &plane(shift, [0; 2]))
}

fn config(checkpoint: &Path, epochs: u64) -> TrainConfig {
    let steps = |rate| TuningSettings {
        epochs,
        batch: 2,
        optimizer: Optimizer::Adam { betas: [0.9, 0.999] },
        learning_rate: LearningRate {
            initial: rate,
            decay: 0.0,
        },
        average_decay: 0.5,
    };
    let mut config = TrainConfig {
        checkpoint: checkpoint.to_path_buf(),
        depth_tuning: steps(5e-3),
        registration_tuning: steps(5e-3),
        ..TrainConfig::ours()
    };
    config.photo_consistency.light = Light::Ignored;
    config
}

fn run(
    step: TuningStep,
    frames: &RecordedFrames,
    config: &TrainConfig,
    report: impl FnMut(Progress),
) -> Result<Tuned, TrainError> {
    run_from((&network(), &template()), step, frames, config, report)
}

fn run_from(
    (network, template): (&Network, &Template),
    step: TuningStep,
    frames: &RecordedFrames,
    config: &TrainConfig,
    report: impl FnMut(Progress),
) -> Result<Tuned, TrainError> {
    let set = TuningSet {
        frames,
        template,
        canonical: &small_camera(),
        truth: &BTreeMap::new(),
    };
    tune(network, step, set, config, &Device::flex(), report)
}

/// The losses of all updates of a tuning, and what it ended with.
fn losses_of(
    start: (&Network, &Template),
    step: TuningStep,
    frames: &RecordedFrames,
    config: &TrainConfig,
) -> (Vec<f64>, Tuned) {
    let mut losses = Vec::new();
    let tuned = run_from(start, step, frames, config, |progress| {
        if let Progress::Step { loss, .. } = progress {
            losses.push(loss);
        }
    });
    (losses, tuned.unwrap())
}

fn frames(training: usize) -> RecordedFrames {
    RecordedFrames {
        training: (0..training).map(|index| frame(index, 0.02 * index as f32)).collect(),
        held_out: vec![frame(9, 0.03)],
        left_out: 0,
        colors: ColorResponse::IDENTITY,
    }
}

/// Weights by their paths.
#[derive(Default)]
struct Weights {
    path: Vec<String>,
    values: BTreeMap<String, Vec<f32>>,
}

impl ModuleVisitor for Weights {
    fn enter_module(&mut self, name: &str, _container: &str) {
        self.path.push(name.to_owned());
    }

    fn exit_module(&mut self, _name: &str, _container: &str) {
        self.path.pop();
    }

    fn visit_float<const D: usize>(&mut self, param: &Param<Tensor<D>>) {
        let values = param.val().into_data().try_to_vec().unwrap();
        self.values.insert(self.path.join("."), values);
    }
}

fn weights(network: &Network) -> BTreeMap<String, Vec<f32>> {
    let mut weights = Weights::default();
    network.visit(&mut weights);
    assert!(weights.values.len() > 20, "the network's weights were not visited");
    weights.values
}

#[test]
fn step_one_learns_a_sample_by_heart() {
    let folder = tempfile::tempdir().unwrap();
    let synthesizer = Arc::new(Synthesizer::new(&template(), SynthConfig::default()).unwrap());
    let windows = BatchShape {
        frames: 2,
        width: 96,
        height: 96,
    };
    let config = TrainConfig {
        budget: Budget::Samples(2 * 80),
        epoch_samples: Some(1),
        held_out_frames: 1,
        checkpoint: folder.path().join("checkpoint"),
        schedule: Schedule {
            windows,
            frames: windows,
            warm_up: 5,
            ..Schedule::default()
        },
        seed: 3,
        ..TrainConfig::ours()
    };
    let mut losses = Vec::new();
    let trained = train(&synthesizer, network().config(), &config, &Device::flex(), |progress| {
        if let Progress::Step { loss, .. } = progress {
            losses.push(loss);
        }
    })
    .unwrap();
    // Measured before the first step, too.
    let curve = trained.state.curve;
    assert!(curve[0].samples == 0 && curve[0].loss.is_nan() && curve.len() > 1);
    let mean = |losses: &[f64]| losses.iter().sum::<f64>() / losses.len() as f64;
    let (first, last) = (mean(&losses[..5]), mean(&losses[losses.len() - 5..]));
    assert!(last < 0.5 * first, "{first} -> {last}");
}

/// The steps, and the names of their blocks in a network.
const STEPS: [(TuningStep, &str); 2] = [
    (TuningStep::Depth, "depth_refinement"),
    (TuningStep::Registration, "registration_refinement"),
];

/// Checks that of two networks the `block` alone differs, in the weights and biases of its three convolutions.
fn check_that_alone_moved(block: &str, before: &Network, after: &Network) {
    let (before, after) = (weights(before), weights(after));
    assert_eq!(before.len(), after.len());
    let mut moved = 0;
    for (path, values) in &before {
        if path.starts_with(block) {
            moved += usize::from(values != &after[path]);
        } else {
            let same = values.iter().zip(&after[path]).all(|(a, b)| a.to_bits() == b.to_bits());
            assert!(same, "the step of {block} moved {path}");
        }
    }
    assert_eq!(moved, 6, "{block}: weights and biases of three convolutions move");
}

#[test]
fn steps_two_and_three_learn_a_frame_by_heart_and_leave_all_other_blocks_bit_for_bit() {
    for (step, block) in STEPS {
        let folder = tempfile::tempdir().unwrap();
        let (losses, tuned) = losses_of((&network(), &template()), step, &frames(1), &config(folder.path(), 120));
        let (first, last) = (losses[0], losses[losses.len() - 1]);
        assert!(last < 0.1 * first, "{step:?}: {first} -> {last}");
        check_that_alone_moved(block, &network(), &tuned.network);
    }
}

#[test]
fn step_three_can_compare_with_the_template_in_the_cameras_colours() {
    let dull = ColorResponse {
        gain: [0.5; 3],
        offset: [60.0; 3],
    };
    let mut frames = frames(1);
    frames.colors = dull;
    frames.training[0].image = dull.apply(&frames.training[0].image);
    frames.held_out = frames.training.clone();
    let tuned = |light| {
        let folder = tempfile::tempdir().unwrap();
        let mut config = config(folder.path(), 120);
        config.photo_consistency.light = light;
        let tuned = run(TuningStep::Registration, &frames, &config, |_| {});
        tuned.unwrap().after
    };
    let of = |figure: Option<MeanMedian>| figure.unwrap().mean;
    let (ignored, recorded) = (tuned(Light::Ignored), tuned(Light::Recorded));
    assert!(
        of(recorded.recorded_colors_photo_consistency_error) < 0.01,
        "{recorded:?}"
    );
    assert!(of(recorded.photo_consistency_error) > 0.03, "{recorded:?}");
    // In the template's own colours a wrong registration is nearest, that of duller texels.
    assert!(
        of(ignored.photo_consistency_error) < 0.5 * of(recorded.photo_consistency_error),
        "{ignored:?}"
    );
    let missed = of(ignored.recorded_colors_photo_consistency_error);
    assert!(
        missed > 5.0 * of(recorded.recorded_colors_photo_consistency_error),
        "{ignored:?}"
    );
}

#[test]
fn steps_two_and_three_train_a_network_of_rest_positions_across_a_seam() {
    // The print of `template`, cut in two.
    let texture = Picture::from_fn(90, 60, |x, y| {
        let at = in_texture(DVec2::new((x as f64 + 0.5) / 90.0, (y as f64 + 0.5) / 60.0));
        [(20.0 + 180.0 * at.x) as u8, (20.0 + 180.0 * at.y) as u8, 128]
    });
    let template = two_charts(texture, DVec2::new(180.0, 120.0));
    let mut maps = plane(0.0, [0; 2]);
    let mut turned = 0;
    for pixel in (0..maps.depth().len()).filter(|&pixel| plane(0.0, [0; 2]).inside(pixel)) {
        let at = maps.uv(pixel);
        turned += usize::from(in_texture(at) != at);
        maps.set(pixel, maps.depth()[pixel], in_texture(at).as_vec2().to_array());
    }
    assert!(turned * 4 > maps.area() && turned < maps.area(), "{turned} pixels");
    let mut frames = frames(1);
    frames.training[0] = TrainingFrame {
        image: draw_template(template.texture(), &maps),
        ..frame_of(0, &maps)
    };
    let network = network_of_rest_positions();
    for (step, block) in STEPS {
        let folder = tempfile::tempdir().unwrap();
        let config = config(folder.path(), 120);
        let (losses, tuned) = losses_of((&network, &template), step, &frames, &config);
        let (first, last) = (losses[0], losses[losses.len() - 1]);
        assert!(last < 0.1 * first, "{step:?}: {first} -> {last}");
        check_that_alone_moved(block, &network, &tuned.network);
    }
}

/// Sixteen frames to train on and four others between them. Each shows another part of the template, and the farther
/// along u a point is, the farther away: what suits one frame does not suit the others, and what does follows from what
/// is seen.
fn frames_between_others() -> RecordedFrames {
    let seen = |index: usize, shift: f32| {
        let mut maps = plane(shift, [0; 2]);
        for (pixel, inside) in maps.mask().into_iter().enumerate() {
            if inside {
                let [u, v] = maps.registration()[pixel];
                maps.set(pixel, 400.0 + 400.0 * u, [u, v]);
            }
        }
        frame_of(index, &maps)
    };
    let between = [0.03, 0.09, 0.21, 0.27];
    RecordedFrames {
        training: (0..16).map(|i| seen(i, 0.02 * i as f32)).collect(),
        held_out: (16..).zip(between).map(|(i, shift)| seen(i, shift)).collect(),
        left_out: 0,
        colors: ColorResponse::IDENTITY,
    }
}

#[test]
fn steps_two_and_three_lower_the_errors_on_frames_that_are_held_out() {
    let frames = frames_between_others();
    let tuned = |step| {
        let folder = tempfile::tempdir().unwrap();
        let mut config = config(folder.path(), 60);
        for steps in [&mut config.depth_tuning, &mut config.registration_tuning] {
            steps.batch = 4;
            steps.learning_rate.decay = 0.01;
            steps.average_decay = 0.9;
        }
        run(step, &frames, &config, |_| {}).unwrap()
    };
    let mean = |figure: Option<MeanMedian>| figure.unwrap().mean;
    let Tuned { before, after, .. } = tuned(TuningStep::Depth);
    let [before, after] = [before, after].map(|figures| mean(figures.measured_depth_rmse_mm));
    assert!(after < before / 4.0, "depth RMSE {before} -> {after} mm");
    let Tuned { before, after, .. } = tuned(TuningStep::Registration);
    let [before, after] = [before, after].map(|figures| mean(figures.photo_consistency_error));
    assert!(after < before / 4.0, "E_pr {before} -> {after}");
    // The one registration that is in the middle of all frames does not do that.
    let middle = plane(0.15, [0; 2]);
    let texture = template();
    let errors = frames.held_out.iter().map(|frame| {
        let error = photo_consistency_error(&frame.image, texture.texture(), &middle);
        error.unwrap()
    });
    let same_for_all = errors.sum::<f64>() / frames.held_out.len() as f64;
    assert!(after < same_for_all, "{after} and {same_for_all}");
}

#[test]
fn the_papers_preset_has_its_numbers_and_learns_with_them() {
    let paper = TrainConfig::paper();
    let (two, three) = (paper.depth_tuning, paper.registration_tuning);
    assert_eq!((two.epochs, two.batch, three.epochs, three.batch), (10, 7, 10, 6));
    assert_eq!(two.optimizer, Optimizer::Sgd { momentum: 0.0 });
    assert_eq!(three.optimizer, Optimizer::Sgd { momentum: 0.9 });
    assert_eq!((two.learning_rate.initial, two.learning_rate.decay), (1e-5, 0.0));
    assert_eq!((three.learning_rate.initial, three.learning_rate.decay), (1e-5, 1e-9));
    let (depth, photo) = (paper.depth_loss, paper.photo_consistency);
    assert_eq!((depth.total_variation, photo.total_variation), (1e-9, 1e-9));
    assert_eq!((photo.cauchy_scale, photo.half_size), (4.0, 0.5));
    assert_eq!((photo.residual, photo.light), (Residual::Squared, Light::Ignored));
    // Our reading of what the paper leaves open, with which its rates learn.
    assert_eq!(depth.unit_mm, Some(100.0));

    let frames = frames_between_others();
    let mean = |metric: Option<MeanMedian>| metric.unwrap().mean;
    for (step, _) in STEPS {
        let folder = tempfile::tempdir().unwrap();
        let mut config = TrainConfig {
            checkpoint: folder.path().join("checkpoint"),
            ..TrainConfig::paper()
        };
        // The paper's ten epochs of 2,728 frames are 3,900 updates; these are 120.
        config.depth_tuning.epochs = 40;
        config.registration_tuning.epochs = 40;
        let (losses, tuned) = losses_of((&network(), &template()), step, &frames, &config);
        let epoch = losses.len() / 40;
        let (first, last) = (&losses[..epoch], &losses[losses.len() - epoch..]);
        let decrease = last.iter().sum::<f64>() / first.iter().sum::<f64>();
        println!(
            "{step:?}: loss times {decrease}, {:?} -> {:?}",
            tuned.before, tuned.after
        );
        assert!(decrease < 0.9, "{step:?}: {losses:?}");
        let (before, after) = match step {
            TuningStep::Depth => (tuned.before.measured_depth_rmse_mm, tuned.after.measured_depth_rmse_mm),
            TuningStep::Registration => (
                tuned.before.photo_consistency_error,
                tuned.after.photo_consistency_error,
            ),
        };
        assert!(mean(after) < 0.95 * mean(before), "{step:?}: {before:?} -> {after:?}");
    }
}

#[test]
fn a_tuning_that_was_stopped_goes_on_with_the_same_losses_and_ends_with_the_same_weights() {
    for step in [TuningStep::Depth, TuningStep::Registration] {
        let folder = tempfile::tempdir().unwrap();
        let (whole, half) = (folder.path().join("whole"), folder.path().join("half"));
        let mut losses = Vec::new();
        let uninterrupted = run(step, &frames(3), &config(&whole, 4), |progress| match progress {
            Progress::Step { loss, .. } => losses.push(loss),
            Progress::Evaluated(point) if point.samples == 6 => copy(&whole, &half),
            _ => {}
        })
        .unwrap();
        let mut resumed_losses = Vec::new();
        let resume = TrainConfig {
            resume: true,
            ..config(&half, 4)
        };
        let resumed = run(step, &frames(3), &resume, |progress| match progress {
            Progress::Step { loss, .. } => resumed_losses.push(loss),
            Progress::Resumed { samples, .. } => assert_eq!(samples, 6),
            _ => {}
        })
        .unwrap();
        // Two steps per epoch of three frames: the first four were made before.
        assert_eq!(losses.len(), 8);
        assert_eq!(resumed_losses, losses[4..]);
        assert!(weights(&resumed.network) == weights(&uninterrupted.network), "{step:?}");
        assert_eq!(resumed.before, uninterrupted.before);
        assert_eq!(resumed.after, uninterrupted.after);
        // One that has ended goes on with more epochs.
        let short = folder.path().join("short");
        run(step, &frames(3), &config(&short, 2), |_| {}).unwrap();
        let longer = TrainConfig {
            resume: true,
            ..config(&short, 4)
        };
        let longer = run(step, &frames(3), &longer, |_| {}).unwrap();
        assert!(weights(&longer.network) == weights(&uninterrupted.network), "{step:?}");
        assert_eq!(longer.state.curve.len(), uninterrupted.state.curve.len());
        // Another recording is another training.
        let error = run(step, &frames(2), &resume, |_| {}).err().unwrap();
        assert!(matches!(error, TrainError::CheckpointMismatch { .. }), "{error}");
    }
}

#[test]
fn a_checkpoint_of_another_network_alone_is_set_aside() {
    let folder = tempfile::tempdir().unwrap();
    let step = TuningStep::Depth;
    let config = TrainConfig {
        resume: true,
        ..config(&folder.path().join("checkpoint"), 1)
    };
    run(step, &frames(2), &config, |_| {}).unwrap();
    let set_aside = |network: &Network, step, frames: &RecordedFrames, config: &TrainConfig| {
        let set = TuningSet {
            frames,
            template: &template(),
            canonical: &small_camera(),
            truth: &BTreeMap::new(),
        };
        set_aside_outdated(network, step, set, config).unwrap()
    };
    let other = another_network();
    let mut settings = config.clone();
    settings.depth_loss.total_variation *= 2.0;
    let seed = TrainConfig {
        seed: config.seed + 1,
        ..config.clone()
    };
    assert_eq!(set_aside(&network(), step, &frames(2), &config), None);
    assert_eq!(set_aside(&network(), step, &frames(3), &config), None);
    assert_eq!(set_aside(&other, step, &frames(3), &config), None);
    assert_eq!(set_aside(&other, TuningStep::Registration, &frames(2), &config), None);
    assert_eq!(set_aside(&other, step, &frames(2), &settings), None);
    assert_eq!(set_aside(&other, step, &frames(2), &seed), None);
    // What differs is refused, and stays where it is.
    let error = run(step, &frames(3), &config, |_| {}).err().unwrap();
    assert!(matches!(error, TrainError::CheckpointMismatch { .. }), "{error}");
    // More epochs are no other settings; another network may see the object in other pixels.
    let mut longer = config.clone();
    longer.depth_tuning.epochs = 3;
    let mut seen_elsewhere = frames(2);
    seen_elsewhere.training[0].inside[0] ^= true;
    let kept = set_aside(&other, step, &seen_elsewhere, &longer).unwrap();
    assert_eq!(kept, folder.path().join("checkpoint.outdated"));
    assert!(kept.join("state.json").is_file() && !config.checkpoint.exists());
    assert_eq!(set_aside(&other, step, &frames(2), &config), None);
    // The next one is kept beside it.
    run(step, &frames(2), &config, |_| {}).unwrap();
    let next = set_aside(&other, step, &frames(2), &config).unwrap();
    assert_eq!(next, folder.path().join("checkpoint.outdated-2"));
    assert!(next.join("state.json").is_file() && kept.join("state.json").is_file());
}

/// A narrow network of the paper's with its first weights, folded, and a synthetic image for it.
fn narrow_paper() -> (Network, TrainingFrame, Template) {
    let template = template();
    let synthesizer = Synthesizer::new(&template, SynthConfig::default()).unwrap();
    let sample = (0..)
        .map(|index| synthesizer.sample(2, index))
        .find(|sample| sample.truth.area() > 8_000);
    let (image, truth) = sample.map(|sample| (sample.image, sample.truth)).unwrap();
    let device = Device::flex();
    device.seed(5);
    let architecture = Architecture::Paper(PaperConfig::narrow(16));
    let network = Network::new(
        &NetworkConfig::new(architecture, [180.0, 120.0], &training_camera()),
        &device,
    );
    let frame = TrainingFrame {
        index: 0,
        image,
        depth_mm: truth.depth().iter().map(|&depth| depth.max(0.0)).collect(),
        object: truth.mask(),
        inside: truth.mask(),
        depth_counts: truth.mask(),
        level: 0,
    };
    (network.fold(), frame, template)
}

#[test]
fn steps_two_and_three_train_the_papers_network_and_step_two_teaches_it_where_the_object_ends() {
    let (network, frame, template) = narrow_paper();
    let frames = RecordedFrames {
        training: vec![frame.clone()],
        held_out: vec![frame],
        left_out: 0,
        colors: ColorResponse::IDENTITY,
    };
    let set = TuningSet {
        frames: &frames,
        template: &template,
        canonical: &training_camera(),
        truth: &BTreeMap::new(),
    };
    let folder = tempfile::tempdir().unwrap();
    let tuned = |network: &Network, step: TuningStep, rate| {
        let mut config = config(&folder.path().join(step.number().to_string()), 40);
        for settings in [&mut config.depth_tuning, &mut config.registration_tuning] {
            settings.learning_rate.initial = rate;
        }
        let mut losses = Vec::new();
        let tuned = tune(network, step, set, &config, &Device::flex(), |progress| {
            if let Progress::Step { loss, .. } = progress {
                losses.push(loss);
            }
        });
        (losses, tuned.unwrap())
    };
    let (losses, depth) = tuned(&network, TuningStep::Depth, 5e-3);
    println!(
        "step 2: loss {:?} -> {:?}, {:?} -> {:?}",
        losses.first(),
        losses.last(),
        depth.before,
        depth.after
    );
    assert!(losses[39] < 0.1 * losses[0], "{losses:?}");
    let of = |metric: Option<MeanMedian>| metric.unwrap().mean;
    // Before, the whole image is object: an IoU of 0.14, its area. Where only the object is taught, it stays so.
    assert!(
        of(depth.after.mask_iou) > 0.6,
        "{:?} -> {:?}",
        depth.before,
        depth.after
    );
    let (losses, registration) = tuned(&depth.network, TuningStep::Registration, 2e-3);
    println!("step 3: loss {:?} -> {:?}", losses.first(), losses.last());
    assert!(losses[39] < 0.8 * losses[0], "{losses:?}");
    // What step 2 taught stays bit for bit.
    assert_eq!(registration.after.mask_iou, depth.after.mask_iou);
    for (step, block, before, after) in [
        (2, "depth_refinement", &network, &depth.network),
        (3, "registration_refinement", &depth.network, &registration.network),
    ] {
        let (before, after) = (weights(before), weights(after));
        for (path, values) in &before {
            let same = values.iter().zip(&after[path]).all(|(a, b)| a.to_bits() == b.to_bits());
            assert!(same || path.starts_with(block), "step {step} moved {path}");
        }
    }
}
