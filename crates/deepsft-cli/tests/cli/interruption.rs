//! A training that is killed, and goes on.

use crate::common::{deepsft, write_template};
use serde_json::Value;
use std::fs;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::thread::sleep;
use std::time::{Duration, Instant};

/// How long the killed training may take to its first checkpoint: some 32 samples and 48 frames of measurement.
const PATIENCE: Duration = Duration::from_secs(300);

/// Kills the process when the test ends in whatever way.
struct Killed(Child);

impl Drop for Killed {
    fn drop(&mut self) {
        // SIGKILL on Unix: the process has no chance to tidy up.
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// The curve of the checkpoint at `folder`, if it is there and whole.
fn curve(folder: &Path) -> Option<Vec<Value>> {
    let state: Value = serde_json::from_slice(&fs::read(folder.join("state.json")).ok()?).ok()?;
    state["curve"].as_array().cloned()
}

#[test]
fn a_training_that_is_killed_goes_on_and_its_curve_too() {
    let folder = tempfile::tempdir().unwrap();
    write_template(folder.path(), "template");
    let train = [
        "train",
        "--template",
        "template",
        "--out",
        "model",
        "--evaluate-every",
        "0.01",
    ];
    let checkpoint = folder.path().join("model.checkpoint");

    let child = Command::new(env!("CARGO_BIN_EXE_deepsft"))
        .args(train)
        .args(["--samples", "1000000"])
        .current_dir(folder.path())
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    let running = Killed(child);
    let start = Instant::now();
    while curve(&checkpoint).is_none() {
        assert!(start.elapsed() < PATIENCE, "no checkpoint after {PATIENCE:?}");
        sleep(Duration::from_millis(5));
    }
    // It goes on at once with the next step; kill it there, in the middle of training.
    sleep(Duration::from_millis(300));
    drop(running);
    assert!(
        !folder.path().join("model").exists(),
        "a bundle before the training ended"
    );
    let before = curve(&checkpoint)
        .or_else(|| curve(&folder.path().join("model.checkpoint.old")))
        .unwrap();
    let seen = before.last().unwrap()["samples"].as_u64().unwrap();

    deepsft(folder.path(), &[&train[..], &["--samples", "1000000"]].concat()).fails(1, &["add --resume"]);
    let target = (seen + 1).to_string();
    let resumed = deepsft(
        folder.path(),
        &[&train[..], &["--samples", &target, "--resume"]].concat(),
    );
    assert!(
        resumed
            .succeeds()
            .stdout
            .contains(&format!("going on after {seen} samples"))
    );
    let after = curve(&checkpoint).unwrap();
    assert_eq!(after[..before.len()], before[..], "the curve before the kill is kept");
    assert!(after.last().unwrap()["samples"].as_u64().unwrap() > seen);
    deepsft(folder.path(), &["bundle", "verify", "model"]).succeeds();
}
