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
fn step_two_goes_on_where_step_one_has_ended_and_begins_anew_where_step_one_goes_on() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    write_template(folder, "template");
    let simulate = ["recording", "simulate", "--template", "template", "--frames", "4"];
    deepsft(folder, &[&simulate[..], &["--out", "recording"]].concat()).succeeds();
    let train = |samples| {
        let object = ["train", "--template", "template", "--recording", "recording"];
        let steps = ["--stages", "1,2", "--epochs", "1", "--samples", samples];
        [&object[..], &steps, &["--out", "model", "--resume"]].concat()
    };
    let anew = "step 2 begins anew";
    let outdated = folder.join("model.step-2.checkpoint.outdated/state.json");
    // The table comes after the epoch, whose checkpoint is there by then.
    let first = train_until(folder, "after step 2", &train("1"));
    assert!(folder.join("model.step-2.checkpoint/state.json").is_file());
    let second = train_until(folder, "after step 2", &train("1"));
    for lines in [&first, &second] {
        assert!(!lines.iter().any(|line| line.contains(anew)), "{lines:?}");
    }
    let resumed = |lines: &[String]| lines.iter().filter(|line| line.contains("going on after")).count();
    assert_eq!((resumed(&first), resumed(&second)), (0, 2), "{second:?}");
    assert!(!outdated.exists());
    // A batch of samples more: step 2 would start from another network.
    let third = train_until(folder, anew, &train("17"));
    assert_eq!(resumed(&third), 1, "{third:?}");
    assert!(outdated.is_file() && !folder.join("model.step-2.checkpoint").exists());
}
