//! Every shipped model loads, and does on unseen frames what its card says.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use deepsft::{DeviceKind, Estimator, MODEL_FILE, ModelBundle, start_device};
use deepsft_geometry::fitting::FrameFitter;
use deepsft_geometry::{CompletionOptions, MapsCompletion, MeshRecovery, Topology};
use deepsft_synth::{SynthConfig, Synthesizer};
use deepsft_train::Evaluation;
use std::collections::BTreeMap;
use std::path::PathBuf;

/// Seed of the frames here; no training, evaluation or clip uses it.
const SEED: u64 = 0x51b;
const FRAMES: u64 = 40;

/// How much worse than the card a median over 40 frames may be: the spread of such medians, seen over
/// several seeds, is under a fifth.
const SLACK: f64 = 1.5;

fn bundles() -> Vec<(PathBuf, ModelBundle)> {
    let folders = std::fs::read_dir(deepsft_tests::root().join("models")).unwrap();
    let folders: Vec<PathBuf> = folders
        .map(|e| e.unwrap().path())
        .filter(|p| p.join(MODEL_FILE).is_file())
        .collect();
    assert!(!folders.is_empty(), "no model is shipped");
    folders
        .into_iter()
        .map(|folder| {
            let description = std::fs::read(folder.join(MODEL_FILE)).unwrap();
            let names = ModelBundle::file_names(&description).unwrap();
            let mut files: BTreeMap<String, Vec<u8>> = names
                .into_iter()
                .map(|(name, _)| (name.clone(), std::fs::read(folder.join(name)).unwrap()))
                .collect();
            files.insert(MODEL_FILE.to_owned(), description);
            let bundle = ModelBundle::from_files(&files).unwrap_or_else(|e| panic!("{}: {e}", folder.display()));
            (folder, bundle)
        })
        .collect()
}

#[test]
fn every_shipped_model_is_as_accurate_as_its_card_says() {
    for (folder, bundle) in bundles() {
        let (device, _) = pollster::block_on(start_device(DeviceKind::Cpu)).unwrap();
        let estimator = Estimator::new(&bundle, &device).unwrap();
        let synthesizer = Synthesizer::new(bundle.template(), SynthConfig::default()).unwrap();
        let summary = |recovery: Option<&mut MeshRecovery>| {
            let samples = (0..FRAMES).map(|index| synthesizer.sample(SEED, index));
            let evaluation = Evaluation::run(&estimator, recovery, bundle.template(), samples, |_, _, _, _| {});
            evaluation.unwrap().summary()
        };
        let fitted = {
            let fitter = FrameFitter::new(bundle.template()).unwrap();
            summary(Some(&mut MeshRecovery::Fit(Box::new(fitter)))).median
        };
        let completed = {
            let completion = MapsCompletion::new(bundle.template().mesh(), CompletionOptions::default()).unwrap();
            summary(Some(&mut MeshRecovery::Completion(Box::new(completion)))).median
        };
        let summary = summary(None);
        let accuracy = &bundle.card().accuracy;
        let pixels = summary.median.registration_rmse_px.unwrap();
        let depth = summary.median.depth_rmse_mm.unwrap();
        let iou = summary.mean.mask_iou.unwrap();
        let name = folder.display();
        assert!(
            pixels <= SLACK * accuracy.registration_rmse_px.unwrap(),
            "{name}: {pixels} px"
        );
        assert!(depth <= SLACK * accuracy.depth_rmse_mm.unwrap(), "{name}: {depth} mm");
        assert!(
            1.0 - iou <= SLACK * (1.0 - accuracy.mask_iou.unwrap()),
            "{name}: IoU {iou}"
        );
        // Completion leaves what is seen about as it is.
        let completed = completed.depth_rmse_mm.unwrap();
        assert!(completed <= 1.1 * depth, "{name}: {depth} mm, completed {completed} mm");
        // The fit halves the errors of a sheet at least; of a solid it takes a third away.
        let gain = if bundle.template().is_sheet() { 2.0 } else { 1.5 };
        let (fitted_pixels, fitted_depth) = (fitted.registration_rmse_px.unwrap(), fitted.depth_rmse_mm.unwrap());
        assert!(
            gain * fitted_pixels <= pixels && gain * fitted_depth <= depth,
            "{name}: {pixels} px, {depth} mm; fitted {fitted_pixels} px, {fitted_depth} mm"
        );
    }
}

/// An upright image is turned for the network and its maps are turned back: the same numbers as of the image that lies across.
#[test]
fn the_maps_of_an_upright_image_are_those_of_the_turned_one() {
    for (_, bundle) in bundles() {
        let (device, _) = pollster::block_on(start_device(DeviceKind::Cpu)).unwrap();
        let estimator = Estimator::new(&bundle, &device).unwrap();
        let synthesizer = Synthesizer::new(bundle.template(), SynthConfig::default()).unwrap();
        let sample = (0..)
            .map(|index| synthesizer.sample(SEED, index))
            .find(|s| s.has_template)
            .unwrap();
        let turned = (0..3).fold(sample.image.clone(), |image, _| image.turned_clockwise());
        let estimate = |image, camera| pollster::block_on(estimator.estimate(image, camera)).unwrap();
        let across = estimate(&sample.image, &sample.camera);
        let upright = estimate(&turned, &sample.camera.turned_anticlockwise());
        assert_eq!(upright.maps, across.maps.turned_anticlockwise());
        assert_eq!(upright.canonical, turned);
        assert_eq!(upright.judgement.found, across.judgement.found);
        let seen = sample.truth.mask();
        let where_seen = |image, seen: &[bool]| pollster::block_on(estimator.infer_stages(image, Some(seen))).unwrap();
        let stages = where_seen(&across.canonical, &seen);
        let turned_seen = sample.truth.turned_anticlockwise().mask();
        for ((_, upright), (_, across)) in where_seen(&turned, &turned_seen).iter().zip(&stages) {
            assert_eq!(*upright, across.turned_anticlockwise());
        }
        assert!(pollster::block_on(estimator.infer_stages(&turned, Some(&seen[1..]))).is_err());
    }
}

/// The object with a volume that networks are trained for: a program of an earlier commit made it.
#[test]
fn the_soft_toy_is_one_closed_surface_in_eighteen_charts() {
    let toy = deepsft_formats::read_template(&deepsft_tests::root().join("models/soft-toy/template")).unwrap();
    let topology = Topology::of(toy.mesh()).unwrap();
    assert_eq!((toy.mesh().faces().len(), topology.charts), (7100, 18));
    assert_eq!(topology.genus(), Some(0));
}

#[test]
fn the_compact_network_keeps_its_promise_of_size() {
    for (folder, bundle) in bundles() {
        let (device, _) = pollster::block_on(start_device(DeviceKind::Cpu)).unwrap();
        let parameters = Estimator::new(&bundle, &device).unwrap().parameters();
        assert!(parameters <= 4_000_000, "{}: {parameters} parameters", folder.display());
    }
}
