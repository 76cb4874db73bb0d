//! Estimates against exact and against measured truth.

use deepsft::{Accuracy, DeviceKind, Estimator, FoundRule, ModelBundle, ModelCard, NetworkConfig, Provenance};
use deepsft_geometry::glam::DVec2;
use deepsft_geometry::metrics::FrameMetrics;
use deepsft_geometry::{Maps, Picture, Template, training_camera};
use deepsft_network::{Network, start_device};
use deepsft_synth::RecordedFrame;
use deepsft_train::{Evaluation, EvaluationFrame};

const SIZE: DVec2 = DVec2::new(200.0, 100.0);

/// Maps in which 100 x 100 pixels at the top left are at 400 mm.
fn predicted() -> Maps {
    let mut maps = Maps::empty((480, 270));
    for pixel in (0..100).flat_map(|y| (0..100).map(move |x| y * 480 + x)) {
        maps.set(pixel, 400.0, [0.1, 0.2]);
    }
    maps
}

fn recorded(depth: impl Fn(usize) -> f32, mask: Option<Vec<bool>>) -> EvaluationFrame {
    let frame = RecordedFrame {
        image: Picture::from_fn(480, 270, |_, _| [0; 3]),
        depth_mm: (0..480 * 270).map(depth).collect(),
        mask,
    };
    EvaluationFrame::recorded(frame, training_camera())
}

fn errors(frame: &EvaluationFrame, maps: &Maps) -> FrameMetrics {
    frame
        .metrics(maps, maps, &frame.truth.reference(maps), SIZE.into())
        .unwrap()
}

#[test]
fn models_are_compared_over_the_same_measured_pixels_and_a_failure_counts() {
    let inside = |pixel: usize| pixel % 480 < 100 && pixel < 100 * 480;
    let frame = recorded(|_| 400.0, Some((0..480 * 270).map(inside).collect()));
    let right = predicted();
    // 40 mm off, less than 15 % of it, in one half and 100 mm off, more than that, in the other.
    let mut wrong = predicted();
    for pixel in (0..480 * 270).filter(|&pixel| inside(pixel)) {
        wrong.set(pixel, if pixel % 480 < 50 { 440.0 } else { 500.0 }, [0.1, 0.2]);
    }
    assert_eq!(frame.truth.reference(&right), frame.truth.reference(&wrong));
    assert_eq!(frame.truth.reference(&wrong).area(), 96 * 96);
    assert_eq!(errors(&frame, &right).depth_rmse_mm, Some(0.0));
    let expected = ((40.0_f64.powi(2) + 100.0_f64.powi(2)) / 2.0).sqrt();
    assert!((errors(&frame, &wrong).depth_rmse_mm.unwrap() - expected).abs() < 1e-9);
    // A wall begins in column 50: columns 49 and 50 are its edge, two more on each side are near it.
    let wall = recorded(|pixel| if pixel % 480 < 50 { 400.0 } else { 900.0 }, Some(right.mask()));
    assert_eq!(wall.truth.reference(&right).area(), (100 - 2 - 2 - 6) * 96);
}

#[test]
fn a_measured_depth_has_errors_in_depth_and_in_space_only() {
    // Off by 3 mm in odd columns.
    let frame = recorded(|pixel| if pixel % 2 == 1 { 403.0 } else { 400.0 }, None);
    let metrics = errors(&frame, &predicted());
    // Columns 2 to 97: as many odd ones as even ones.
    assert!((metrics.depth_rmse_mm.unwrap() - 4.5_f64.sqrt()).abs() < 1e-12);
    assert!(metrics.points_rmse_mm > metrics.depth_rmse_mm);
    let none = [metrics.registration_rmse_px, metrics.registration_rmse_mm];
    assert_eq!((none, metrics.mask_iou, metrics.coverage), ([None; 2], None, None));
    assert!(frame.truth.has_template() && !frame.truth.has_registration());
}

#[test]
fn a_recordings_mask_says_what_is_the_object() {
    let mask = |columns: std::ops::Range<usize>| {
        let inside = |pixel: usize| columns.contains(&(pixel % 480)) && pixel < 100 * 480;
        Some((0..480 * 270).map(inside).collect())
    };
    // Right where it is not the object, 40 mm off where it is. Half of the prediction is on it, and 2/3 of it is
    // predicted.
    let frame = recorded(|pixel| if pixel % 480 < 50 { 400.0 } else { 440.0 }, mask(50..125));
    let metrics = errors(&frame, &predicted());
    assert_eq!(metrics.depth_rmse_mm, Some(40.0));
    assert_eq!(metrics.mask_iou, Some(50.0 / 125.0));
    assert_eq!(metrics.coverage, Some(50.0 / 75.0));
    assert!(!recorded(|_| 500.0, mask(0..0)).truth.has_template());
}

#[test]
fn every_model_is_compared_at_all_pixels_that_the_recording_offers_whatever_its_own_mask() {
    let device = pollster::block_on(start_device(DeviceKind::Cpu)).unwrap().0;
    let template = Template::thin_shell(
        Picture::from_fn(20, 10, |x, y| [(12 * x) as u8, (25 * y) as u8, 9]),
        200.0,
        100.0,
    );
    let template = template.unwrap();
    let network = Network::new(&NetworkConfig::compact([200.0, 100.0], &training_camera()), &device);
    let card = ModelCard {
        name: "untrained".to_owned(),
        licence: Some("MIT OR Apache-2.0".to_owned()),
        found: FoundRule::default(),
        provenance: Provenance::default(),
        accuracy: Accuracy::default(),
    };
    let bundle = ModelBundle::new(network.folded(), template.clone(), training_camera(), card);
    let estimator = Estimator::new(&bundle, &deepsft::Device::Cpu).unwrap();
    // What an untrained network has in its mask is a matter of chance: half of the image is offered, then the other.
    let halves = [true, false].map(|left| {
        let mask = (0..480 * 270).map(|pixel| (pixel % 480 < 240) == left);
        recorded(|_| 400.0, Some(mask.collect()))
    });
    let ablation = Evaluation::ablation(&estimator, &template, halves.clone(), || {}).unwrap();
    let answer = Evaluation::run(&estimator, None, &template, halves, |_, _, _, _| {}).unwrap();
    let last = &ablation.last().unwrap().1;
    for evaluation in ablation.iter().map(|(_, row)| row).chain([&answer]) {
        for frame in &evaluation.frames {
            let pixels = frame.measured_pixels.unwrap();
            assert_eq!((pixels.measured, pixels.compared), (236 * 266, 236 * 266));
        }
    }
    for (one, other) in answer.frames.iter().zip(&last.frames) {
        assert!(one.metrics.depth_rmse_mm.is_some());
        assert_eq!(one.metrics, other.metrics);
    }
}
