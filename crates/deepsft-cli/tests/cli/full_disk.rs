//! A disk that becomes full. The system stands in for it with a limit on the size of files, which needs no rights: a write fails
//! in the middle of a file, and only the reason differs.
#![cfg(target_os = "linux")]

use crate::common::{Run, deepsft, deepsft_with_small_files, write_template};
use std::collections::BTreeSet;
use std::fs;
use std::path::Path;

/// Largest file, bytes: less than any picture, shard or checkpoint here has, more than a description.
const LARGEST_FILE: u64 = 4096;

/// Runs a command line with files so small, which has to fail and say which file and why.
fn fails_for_space(folder: &Path, line: &str) {
    let words: Vec<&str> = line.split(' ').collect();
    let run: Run = deepsft_with_small_files(folder, LARGEST_FILE, &words);
    run.fails(1, &["File too large", "result"]);
}

/// Names in a folder.
fn names(folder: &Path) -> BTreeSet<String> {
    let entries = fs::read_dir(folder).unwrap();
    entries
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect()
}

#[test]
fn a_full_disk_is_told_with_the_file_leaves_nothing_half_written_and_hurts_no_older_result() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    write_template(folder, "template");
    let run = |line: &str| deepsft(folder, &line.split(' ').collect::<Vec<_>>());
    run("clip --template template --frames 2 --out film").succeeds();
    let before = names(folder);
    for line in [
        "template new --image film/frame-00000.png --size-mm 200x112 --out result",
        "clip --template template --frames 2 --out result",
        "recording simulate --template template --frames 1 --out result",
        "track --template template --meshes --pictures --find-every 1 --out result film",
        "reconstruct --template template --out result film/frame-00000.png",
    ] {
        fails_for_space(folder, line);
        let _ = fs::remove_dir(folder.join("result"));
        assert_eq!(names(folder), before, "{line}");
    }
    // An older result stays as it is.
    run("clip --template template --frames 1 --out result").succeeds();
    let older = fs::read(folder.join("result/clip.json")).unwrap();
    fails_for_space(folder, "clip --template template --frames 2 --out result");
    assert_eq!(fs::read(folder.join("result/clip.json")).unwrap(), older);
    run("clip --template template --frames 2 --out result").succeeds();
    assert_ne!(fs::read(folder.join("result/clip.json")).unwrap(), older);
}

#[test]
fn what_a_full_disk_stopped_goes_on_when_there_is_space_again() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    write_template(folder, "template");
    let run = |line: &str| deepsft(folder, &line.split(' ').collect::<Vec<_>>());
    let synth = "synth --template template --count 4 --shard-size 2 --seed 1 --out result";
    fails_for_space(folder, synth);
    assert!(!folder.join("result").exists());
    assert_eq!(
        names(&folder.join("result.partial")),
        BTreeSet::from(["state.json".to_owned()])
    );
    run(synth).succeeds();
    run("synth --template template --count 12 --seed 2 --out data").succeeds();
    let train = "train --template template --data data --samples 1 --evaluate-every 0.001 --accuracy-frames 1 \
                 --out result-model";
    let before = names(folder);
    fails_for_space(folder, train);
    assert_eq!(names(folder), before, "half of a checkpoint");
    run(train).succeeds();
    assert!(folder.join("result-model/weights.bpk").exists());
}
