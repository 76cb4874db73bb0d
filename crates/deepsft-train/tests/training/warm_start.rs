//! A training that begins with the trunk of another network.

use crate::common::{alone, small_compact, weights};
use crate::resume::{config, synthesizer};
use burn::module::Module;
use burn::tensor::Device;
use deepsft::{NetworkConfig, WEIGHTS_FILE};
use deepsft_geometry::training_camera;
use deepsft_network::Network;
use deepsft_train::{Progress, TrainConfig, TrainError, Trained, train};
use std::fs;
use std::path::Path;

/// Writes the weights of a new small network into `folder`, as a model bundle has them, and returns them by their names.
fn write_weights(folder: &Path) -> deepsft::Weights {
    let network = Network::new(&small_compact(&training_camera()), &Device::flex()).fold();
    fs::create_dir_all(folder).unwrap();
    let bytes = network.clone().into_record().into_bytes().unwrap();
    fs::write(folder.join(WEIGHTS_FILE), &bytes[..]).unwrap();
    network.weights()
}

fn run(network: &NetworkConfig, config: &TrainConfig, report: impl FnMut(Progress)) -> Result<Trained, TrainError> {
    train(&synthesizer(), network, config, &Device::flex(), report)
}

#[test]
fn a_training_begins_with_the_trunk_of_the_file() {
    let _alone = alone();
    let folder = tempfile::tempdir().unwrap();
    let from = folder.path().join("other");
    let theirs = write_weights(&from);
    let mut config = config(&folder.path().join("checkpoint"), false);
    // So slow that weights stay as they were.
    config.schedule.peak = 1e-12;
    config.from = Some(from);
    let begun = run(&small_compact(&training_camera()), &config, |_| {}).unwrap();
    let ours = begun.network.folded().weights;
    let off = |name: &str| {
        let pairs = ours[name].values.iter().zip(&theirs[name].values);
        pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f32::max)
    };
    for name in ["main.encode16.first.weight", "main.lateral8.weight"] {
        assert!(off(name) < 1e-5, "{name} {}", off(name));
    }
    assert!(off("main.bins.0.weight") > 1e-3);
}

#[test]
fn a_training_is_resumed_with_the_weights_that_it_began_with_and_does_not_begin_again() {
    let _alone = alone();
    let folder = tempfile::tempdir().unwrap();
    let [here, there] = ["here", "there"].map(|name| folder.path().join(name));
    write_weights(&here);
    write_weights(&there);
    let network = small_compact(&training_camera());
    let mut config = config(&folder.path().join("checkpoint"), false);
    config.from = Some(here.clone());
    let ended = run(&network, &config, |_| {}).unwrap();
    config.resume = true;
    let mut resumed_at = 0;
    let resumed = run(&network, &config, |progress| {
        if let Progress::Resumed { samples, .. } = progress {
            resumed_at = samples;
        }
    });
    assert_eq!(resumed_at, 16);
    assert!(
        weights(&resumed.unwrap().network) == weights(&ended.network),
        "the weights differ"
    );
    for other in [Some(there), None] {
        config.from = other;
        let error = run(&network, &config, |_| {}).err().unwrap();
        assert!(
            matches!(&error, TrainError::CheckpointMismatch { what, .. } if what.contains("--from")),
            "{error}"
        );
    }
}

#[test]
fn weights_without_this_trunk_are_refused_by_the_name_of_the_file() {
    let _alone = alone();
    let folder = tempfile::tempdir().unwrap();
    let mut config = config(&folder.path().join("checkpoint"), false);
    write_weights(&folder.path().join("narrow"));
    fs::create_dir(folder.path().join("broken")).unwrap();
    fs::write(folder.path().join("broken").join(WEIGHTS_FILE), b"none").unwrap();
    let wide = NetworkConfig::compact([180.0, 120.0], &training_camera());
    for (name, cause) in [
        ("none", "no such file"),
        ("narrow", "has the shape"),
        ("broken", "cannot be used"),
    ] {
        config.from = Some(folder.path().join(name));
        let error = run(&wide, &config, |_| {}).err().unwrap().to_string();
        let file = folder.path().join(name).join(WEIGHTS_FILE);
        assert!(
            error.contains(&file.display().to_string()) && error.contains(cause),
            "{error}"
        );
    }
}
