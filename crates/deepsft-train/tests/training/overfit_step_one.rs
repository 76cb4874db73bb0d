//! Step 1 of the architectures that say full-resolution maps: a narrow network learns one sample by heart, and what it
//! learnt survives export.

use crate::common::alone;
use burn::tensor::Device;
use deepsft::{Architecture, NetworkConfig, PaperConfig, R50FConfig};
use deepsft_geometry::metrics::frame_metrics;
use deepsft_geometry::{Picture, Template, training_camera};
use deepsft_synth::{Sample, SynthConfig, Synthesizer};
use deepsft_train::{Budget, Optimizer, Progress, Schedule, TrainConfig, train};
use std::sync::Arc;

const SIZE_MM: [f64; 2] = [180.0, 120.0];
const SEED: u64 = 2;

fn synthesizer() -> Arc<Synthesizer> {
    let texture = Picture::from_fn(90, 60, |x, y| {
        [(x * 7 % 256) as u8, (y * 11 % 256) as u8, ((x * y) % 256) as u8]
    });
    let template = Template::thin_shell(texture, SIZE_MM[0], SIZE_MM[1]).unwrap();
    // An upright sheet: seed and steps are chosen for it.
    let mut config = SynthConfig::default();
    config.pose.max_roll_deg = 45.0;
    Arc::new(Synthesizer::new(&template, config).unwrap())
}

#[test]
fn narrow_networks_learn_one_sample_by_heart_with_the_paper_s_optimiser() {
    let _alone = alone();
    let synthesizer = synthesizer();
    // Samples that show enough, and a start of the weights with each.
    let has_enough = |sample: &Sample| sample.has_template && sample.truth.area() > 5_000;
    let seeds = || {
        (SEED..SEED + 20)
            .filter(|&seed| has_enough(&synthesizer.sample(seed, 0)))
            .take(3)
    };
    assert_eq!(seeds().next(), Some(SEED), "choose another seed");
    let device = Device::flex();
    // Running statistics that arrive within a few steps.
    let momentum = 0.3;
    let paper = PaperConfig {
        momentum,
        ..PaperConfig::narrow(32)
    };
    let r50f = R50FConfig {
        momentum,
        ..R50FConfig::narrow(16)
    };
    // Some starts die early, and rounding decides which: at the paper's 1e-3 two of six of the narrow R50F. Of three one has to learn.
    for (architecture, steps, rate) in [
        (Architecture::Paper(paper), 48, 3e-3),
        (Architecture::R50F(r50f), 80, 3e-4),
    ] {
        let learns = |seed: u64| {
            let sample = synthesizer.sample(seed, 0);
            let folder = tempfile::tempdir().unwrap();
            let network = NetworkConfig::new(architecture.clone(), SIZE_MM, &training_camera());
            let config = TrainConfig {
                seed,
                budget: Budget::Samples(steps),
                epoch_samples: Some(1),
                held_out_frames: 1,
                evaluate_every: 1e9,
                checkpoint: folder.path().join("checkpoint"),
                optimizer: Optimizer::Adam { betas: [0.9, 0.9] },
                schedule: Schedule::constant(rate, 1),
                average_decay: 0.0,
                ..TrainConfig::ours()
            };
            let mut losses = Vec::new();
            let trained = train(&synthesizer, &network, &config, &device, |told| {
                if let Progress::Step { loss, .. } = told {
                    losses.push(loss);
                }
            })
            .unwrap();
            let maps = pollster::block_on(trained.network.infer(&sample.image, None, None, &device)).unwrap();
            let metrics = frame_metrics(&maps, &sample.truth, &sample.camera, synthesizer.template()).unwrap();
            assert_eq!(losses.len() as u64, steps);
            let (first, last) = (losses[0], losses[losses.len() - 1]);
            let iou = metrics.mask_iou.unwrap();
            println!(
                "{}: loss {first} -> {last}, mask IoU {iou}",
                network.architecture.name()
            );
            // Folded, with running statistics: the mask is that of the sample. Where nothing is learnt the loss stays and an
            // image that is all object has an IoU below 0.15.
            last < 0.2 * first && iou > 0.6
        };
        assert!(seeds().any(learns), "none of three starts learnt its sample");
    }
}
