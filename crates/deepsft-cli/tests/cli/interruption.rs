//! Commands that are killed: a training goes on, and no result is half there.

use crate::common::{deepsft, write_template};
use serde_json::Value;
use std::collections::BTreeMap;
use std::fs;
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
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

/// How often a command is killed, at moments spread over its run.
const KILLS: u32 = 4;

/// The files of a folder, without those that hold times, and without what a data set keeps to go on until it is whole.
fn files(folder: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    let (mut files, mut folders) = (BTreeMap::new(), vec![folder.to_path_buf()]);
    while let Some(inside) = folders.pop() {
        for entry in fs::read_dir(inside).into_iter().flatten() {
            let path = entry.unwrap().path();
            let left_out = ["track.json", "track.csv", "state.json"]
                .iter()
                .any(|name| path.ends_with(name));
            if path.is_dir() {
                folders.push(path);
            } else if !left_out {
                files.insert(
                    path.strip_prefix(folder).unwrap().to_path_buf(),
                    fs::read(&path).unwrap(),
                );
            }
        }
    }
    files
}

#[test]
fn a_killed_command_leaves_the_older_result_or_the_new_one_and_ends_as_if_it_had_not_been_killed() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    write_template(folder, "template");
    let words = |line: &str| -> Vec<String> { line.split(' ').map(str::to_owned).collect() };
    deepsft(folder, &words("clip --template template --frames 6 --out film")).succeeds();
    for (command, older, newer) in [
        (
            "clip --template ../template",
            "--frames 2 --seed 2",
            "--frames 6 --seed 1",
        ),
        (
            "synth --template ../template --shard-size 2",
            "--count 2 --seed 2",
            "--count 6 --seed 1",
        ),
        (
            "track --template ../template --find-every 1",
            "../film",
            "--pictures ../film",
        ),
    ] {
        let [with_older, with_newer] = [older, newer].map(|of| words(&format!("{command} --out out {of}")));
        let case = |name: &str| {
            let case = folder.join(name);
            let _ = fs::remove_dir_all(&case);
            fs::create_dir(&case).unwrap();
            case
        };
        let (whole, killed) = (case("whole"), case("killed"));
        let start = Instant::now();
        deepsft(&whole, &with_newer).succeeds();
        let a_run = start.elapsed();
        deepsft(&killed, &with_older).succeeds();
        let (older, newer, result) = (
            files(&killed.join("out")),
            files(&whole.join("out")),
            killed.join("out"),
        );
        assert_ne!(older, newer);
        for kill in 1..=KILLS {
            let mut run = Command::new(env!("CARGO_BIN_EXE_deepsft"));
            run.args(&with_newer).current_dir(&killed);
            let running = Killed(run.stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap());
            sleep(a_run * kill / (KILLS + 1));
            drop(running);
            let found = files(&result);
            assert!(found == older || found == newer, "{command}: {:?}", found.keys());
        }
        deepsft(&killed, &with_newer).succeeds();
        assert!(files(&result) == newer, "{command}");
        let beside: Vec<_> = fs::read_dir(&killed)
            .unwrap()
            .map(|entry| entry.unwrap().path())
            .collect();
        assert_eq!(beside, [result]);
    }
}
