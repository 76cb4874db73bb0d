//! The ablation of the refinement blocks measures the maps that each block has.

use burn::tensor::Tensor;
use deepsft::{Architecture, DeviceKind, Estimator, ModelBundle, NetworkConfig, R50FConfig, Stage};
use deepsft_geometry::metrics::{FrameMetrics, frame_metrics};
use deepsft_geometry::{Camera, Maps, remove_islands};
use deepsft_network::{Network, NetworkMaps, pictures_to_tensor, start_device};
use deepsft_synth::{Sample, SynthConfig, Synthesizer};
use deepsft_train::{Device, Evaluation};
use std::collections::BTreeMap;
use std::path::Path;

fn device() -> Device {
    pollster::block_on(start_device(DeviceKind::Cpu)).unwrap().0
}

/// The model that ships.
fn poster() -> ModelBundle {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../models/poster-a4");
    let model = std::fs::read(folder.join("model.json")).unwrap();
    let mut files: BTreeMap<String, Vec<u8>> = ModelBundle::file_names(&model)
        .unwrap()
        .into_iter()
        .map(|(name, _)| (name.clone(), std::fs::read(folder.join(&name)).unwrap()))
        .collect();
    files.insert("model.json".to_owned(), model);
    ModelBundle::from_files(&files).unwrap()
}

fn samples(bundle: &ModelBundle, count: usize) -> Vec<Sample> {
    let synthesizer = Synthesizer::new(bundle.template(), SynthConfig::default()).unwrap();
    (0..)
        .map(|index| synthesizer.sample(77, index))
        .filter(|sample| sample.has_template)
        .take(count)
        .collect()
}

/// What [`Network::forward_maps`] says of a sample's image, as [u, v, depth in mm] at each pixel.
fn read(network: &Network, sample: &Sample, maps: impl Fn(&NetworkMaps) -> [Tensor<4>; 2]) -> Maps {
    let said = network.forward_maps(pictures_to_tensor(&[&sample.image], &device()));
    let values = |tensor: Tensor<4>| tensor.into_data().try_to_vec::<f32>().unwrap();
    let [registration, depth] = maps(&said).map(values);
    let mask = values(said.mask_logits.clone());
    let (range, pixels) = (network.config().depth_range, mask.len());
    let mut read = Maps::empty((480, 270));
    for pixel in (0..pixels).filter(|&pixel| mask[pixel] >= 0.0) {
        let depth = range.depth_mm_linear(f64::from(depth[pixel]));
        read.set(pixel, depth as f32, [registration[pixel], registration[pixels + pixel]]);
    }
    remove_islands(&mut read, 0.1);
    read
}

fn close(a: &FrameMetrics, b: &FrameMetrics) -> bool {
    let near = |a: Option<f64>, b: Option<f64>| match (a, b) {
        (Some(a), Some(b)) => (a - b).abs() < 1e-3 * a.abs().max(1.0),
        (a, b) => a == b,
    };
    near(a.depth_rmse_mm, b.depth_rmse_mm)
        && near(a.registration_rmse_px, b.registration_rmse_px)
        && near(a.points_rmse_mm, b.points_rmse_mm)
        && near(a.mask_iou, b.mask_iou)
}

#[test]
fn each_row_measures_the_maps_of_its_block_and_the_last_is_the_answer() {
    let bundle = poster();
    let estimator = Estimator::new(&bundle, &deepsft::Device::Cpu).unwrap();
    let samples = samples(&bundle, 2);
    let template = bundle.template();
    let rows = Evaluation::ablation(&estimator, template, samples.clone(), || {}).unwrap();
    let answer = Evaluation::run(&estimator, None, template, samples.clone(), |_, _, _, _| {}).unwrap();
    let stages: Vec<Stage> = rows.iter().map(|row| row.0).collect();
    assert_eq!(stages, bundle.network().config.architecture.stages());
    let network = &Network::from_folded(bundle.network(), &device()).unwrap();
    let camera: &Camera = bundle.camera();
    for (index, sample) in samples.iter().enumerate() {
        let metrics = |row: usize| &rows[row].1.frames[index].metrics;
        let expected = [
            read(network, sample, |maps| {
                [maps.main_registration.clone(), maps.main_depth.clone()]
            }),
            read(network, sample, |maps| {
                [maps.main_registration.clone(), maps.depth.clone()]
            }),
        ];
        for (row, maps) in expected.iter().enumerate() {
            let expected = frame_metrics(maps, &sample.truth, camera, template.size_mm()).unwrap();
            assert!(close(metrics(row), &expected), "{:?} {expected:?}", metrics(row));
        }
        assert_eq!(*metrics(2), answer.frames[index].metrics);
        // The blocks do something, each to its own map.
        assert_ne!(metrics(0).depth_rmse_mm, metrics(1).depth_rmse_mm);
        assert_eq!(metrics(0).registration_rmse_px, metrics(1).registration_rmse_px);
        assert_ne!(metrics(1).registration_rmse_px, metrics(2).registration_rmse_px);
        assert_eq!(metrics(1).depth_rmse_mm, metrics(2).depth_rmse_mm);
    }
    let fps = |evaluation: &Evaluation| evaluation.summary().median.frames_per_second;
    assert!(fps(&answer) > Some(0.0) && fps(&rows[2].1).is_none());
}

#[test]
fn a_network_without_refinement_blocks_has_one_row() {
    let bundle = poster();
    let device = device();
    let architecture = Architecture::R50F(R50FConfig::narrow(16));
    let network = NetworkConfig::new(architecture, bundle.template().size_mm().to_array(), bundle.camera());
    let network = Network::new(&network, &device);
    assert_eq!(network.config().architecture.stages(), [Stage::Main]);
    let image = &samples(&bundle, 1)[0].image;
    let mut executor = network.folded().executor(image.size()).unwrap();
    executor.run(image).unwrap();
    let [only, answer] = [Stage::Main, Stage::RegistrationRefinement].map(|stage| {
        let mut maps = Maps::empty(image.size());
        executor.read(stage, None, None, &mut maps).unwrap();
        maps
    });
    assert_eq!(only, answer);
}
