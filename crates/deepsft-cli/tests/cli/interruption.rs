//! A training that is killed, and goes on.

use crate::common::{deepsft, write_template};
use serde_json::Value;
use std::fs;
use std::io::{BufRead, BufReader};
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
        "--accuracy-frames",
        "8",
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
    let before = curve(&checkpoint).unwrap();
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

/// Trains in `folder` until a line of the output contains `part`, and kills the training there. Returns the lines.
fn train_until(folder: &Path, part: &str, arguments: &[&str]) -> Vec<String> {
    let mut child = Command::new(env!("CARGO_BIN_EXE_deepsft"))
        .args(arguments)
        .current_dir(folder)
        .stdout(Stdio::piped())
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    let output = BufReader::new(child.stdout.take().unwrap());
    let _running = Killed(child);
    let mut lines = Vec::new();
    for line in output.lines() {
        lines.push(line.unwrap());
        if lines.last().unwrap().contains(part) {
            return lines;
        }
    }
    panic!("{part} was never told: {lines:?}");
}

#[test]
fn step_three_goes_on_where_step_two_has_ended_and_begins_anew_where_step_two_goes_on() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let model = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../models/poster-a4");
    let model = model.to_str().unwrap();
    let simulate = ["recording", "simulate", "--model", model, "--frames", "4"];
    deepsft(folder, &[&simulate[..], &["--out", "recording"]].concat()).succeeds();
    let train = |steps, epochs, extra: &[&'static str]| {
        let object = ["train", "--model", model, "--recording", "recording", "--out", "tuned"];
        [&object[..], &["--steps", steps, "--epochs", epochs], extra].concat()
    };
    let state = |ending: &str| {
        let path = folder.join(format!("tuned.step-3.checkpoint{ending}/state.json"));
        fs::read_to_string(path).ok()
    };
    let count = |lines: &[String], part: &str| lines.iter().filter(|line| line.contains(part)).count();
    let (going_on, anew) = ("going on after", "step 3 begins anew");
    // The row of the table comes after the epoch, whose checkpoint is there by then, and before the bundle.
    let row = "| after step 3 |";
    let first = train_until(folder, row, &train("2,3", "1", &["--resume"]));
    let second = train_until(folder, row, &train("2,3", "1", &["--resume"]));
    assert_eq!((count(&first, going_on), count(&first, anew)), (0, 0), "{first:?}");
    assert_eq!((count(&second, going_on), count(&second, anew)), (2, 0), "{second:?}");
    let short = state("").unwrap();

    // Killed between the two renames of a save, where folders cannot be exchanged.
    let place = |name: &str| folder.join(name);
    fs::rename(
        place("tuned.step-3.checkpoint"),
        place(".tuned.step-3.checkpoint.replaced"),
    )
    .unwrap();
    deepsft(folder, &train("2,3", "1", &[])).fails(1, &["add --resume", "tuned.step-2.checkpoint"]);
    deepsft(folder, &train("3", "1", &[])).fails(1, &["add --resume", "tuned.step-3.checkpoint"]);
    // By itself, step 3 would start from another model than it did.
    deepsft(folder, &train("3", "1", &["--resume"])).fails(1, &["checkpoint was made with another"]);
    assert_eq!(state("").as_ref(), Some(&short));

    // Another epoch of step 2: step 3 would start from another network.
    let third = train_until(folder, row, &train("2,3", "2", &["--resume"]));
    assert_eq!((count(&third, going_on), count(&third, anew)), (1, 1), "{third:?}");
    assert_eq!(state(".outdated").as_ref(), Some(&short));
    let longer = state("").unwrap();
    train_until(folder, anew, &train("2,3", "3", &["--resume"]));
    assert_eq!(state(".outdated").as_ref(), Some(&short), "it was overwritten");
    assert_eq!(state(".outdated-2").as_ref(), Some(&longer));
    // Fewer epochs than there are.
    let told = "it has 3 epochs already, more than the 1 asked for";
    train_until(folder, told, &train("2", "1", &["--resume"]));
}
