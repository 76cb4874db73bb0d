//! What a checkpoint holds.

use deepsft::NetworkConfig;
use deepsft_network::Network;
use deepsft_train::burn::optim::{ModuleOptimizer, SgdConfig};
use deepsft_train::{Checkpoint, CheckpointFolder, CurvePoint, Device, Fingerprint, Saved, TrainError};
use std::fs;

fn network() -> Network {
    let camera = deepsft_geometry::training_camera();
    Network::new(&NetworkConfig::compact([297.0, 210.0], &camera), &Device::flex())
}

fn optimizer() -> ModuleOptimizer {
    SgdConfig::new().init()
}

fn load(checkpoint: &CheckpointFolder) -> Result<Option<Saved>, TrainError> {
    checkpoint.load(|| Ok(network()), optimizer(), &Fingerprint::default(), 0)
}

#[test]
fn a_loss_that_was_not_measured_is_null_in_a_checkpoint() {
    let point = |loss| CurvePoint {
        samples: 6,
        loss,
        depth_rmse_mm: Some(12.5),
        ..CurvePoint::default()
    };
    let state = Checkpoint {
        curve: vec![point(f64::NAN), point(0.25)],
        ..Checkpoint::default()
    };
    let text = serde_json::to_string(&state).unwrap();
    assert!(
        text.contains("\"loss\":null") && text.contains("\"loss\":0.25"),
        "{text}"
    );
    let read: Checkpoint = serde_json::from_str(&text).unwrap();
    assert!(read.curve[0].loss.is_nan());
    assert_eq!(read.curve[1], state.curve[1]);
}

#[test]
fn a_checkpoint_is_replaced_and_one_that_cannot_be_read_is_an_error_that_names_its_file() {
    let folder = tempfile::tempdir().unwrap();
    let place = |name: &str| folder.path().join(name);
    let checkpoint = CheckpointFolder::new(place("model.checkpoint"));
    let network = network();
    let save = |samples| {
        let state = Checkpoint {
            samples,
            ..Checkpoint::default()
        };
        checkpoint.save(&state, &network, None, &optimizer()).unwrap();
    };
    let samples = || load(&checkpoint).unwrap().unwrap().state.samples;
    save(7);
    save(14);
    assert_eq!(samples(), 14);
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
    // Killed between two renames, where folders cannot be exchanged.
    fs::rename(place("model.checkpoint"), place(".model.checkpoint.replaced")).unwrap();
    assert_eq!(samples(), 14);
    fs::write(place("model.checkpoint").join("state.json"), "").unwrap();
    let error = load(&checkpoint).unwrap_err().to_string();
    assert!(error.contains("state.json"), "{error}");
    save(21);
    assert_eq!(samples(), 21);
    // The weights are no state of an optimiser, at which burn panics, though the file is whole.
    let [weights, state] = ["network.bpk", "optimizer.bpk"].map(|name| place("model.checkpoint").join(name));
    fs::copy(weights, state).unwrap();
    let error = load(&checkpoint).unwrap_err().to_string();
    assert!(
        error.contains("not as it was saved") && error.contains("optimizer.bpk"),
        "{error}"
    );
}
