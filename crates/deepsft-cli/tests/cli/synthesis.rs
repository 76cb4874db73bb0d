//! `deepsft synth`: killed and going on, in parts, with presets and photographs.

use crate::common::{deepsft, write_bundle, write_photograph, write_template};
use serde_json::Value;
use std::fs;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::thread::sleep;
use std::time::{Duration, Instant, SystemTime};

/// How long a killed synthesis may take to its first shards.
const PATIENCE: Duration = Duration::from_secs(120);

/// Kills the process (SIGKILL on Unix) when the test ends in whatever way.
struct Killed(Child);

impl Drop for Killed {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

fn json(path: &Path) -> Option<Value> {
    serde_json::from_slice(&fs::read(path).ok()?).ok()
}

/// Names and contents of the files of a folder.
fn files(folder: &Path) -> Vec<(String, Vec<u8>)> {
    let entries = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap());
    let mut files: Vec<_> = entries
        .map(|entry| {
            (
                entry.file_name().into_string().unwrap(),
                fs::read(entry.path()).unwrap(),
            )
        })
        .collect();
    files.sort();
    files
}

fn modified(path: &Path) -> SystemTime {
    fs::metadata(path).unwrap().modified().unwrap()
}

#[test]
fn a_synthesis_that_is_killed_goes_on_and_makes_no_finished_shard_again() {
    let folder = tempfile::tempdir().unwrap();
    write_template(folder.path(), "template");
    let synth = |out: &'static str| {
        let words = "synth --template template --count 40 --seed 8 --shard-size 2 --out";
        words.split(' ').chain([out]).collect::<Vec<_>>()
    };
    let child = Command::new(env!("CARGO_BIN_EXE_deepsft"))
        .args(synth("set"))
        .current_dir(folder.path())
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    let running = Killed(child);
    let state = folder.path().join("set.partial/state.json");
    let shards = || json(&state).map_or(0, |state| state["shards"].as_array().unwrap().len());
    let start = Instant::now();
    while shards() < 3 {
        assert!(start.elapsed() < PATIENCE, "no shards after {PATIENCE:?}");
        sleep(Duration::from_millis(2));
    }
    drop(running);
    assert!(!folder.path().join("set").exists(), "a data set before it was finished");
    let finished = shards();
    assert!(finished < 20, "it was finished before it was killed");
    let first = modified(&folder.path().join("set.partial/shard-000000.tar"));

    // Another seed would not fit what is there.
    let other: Vec<_> = synth("set")
        .into_iter()
        .map(|word| if word == "8" { "9" } else { word })
        .collect();
    deepsft(folder.path(), &other).fails(1, &["set.partial", "seed 8, not 9"]);

    let resumed = deepsft(folder.path(), &synth("set"));
    let told = &resumed.succeeds().stdout;
    assert!(
        told.contains(&format!("going on after {} samples", 2 * finished)),
        "{told}"
    );
    assert_eq!(
        modified(&folder.path().join("set/shard-000000.tar")),
        first,
        "made again"
    );
    assert!(!folder.path().join("set.partial").exists());
    deepsft(folder.path(), &synth("at-once")).succeeds();
    assert!(files(&folder.path().join("set")) == files(&folder.path().join("at-once")));

    let again = deepsft(folder.path(), &synth("set"));
    assert!(again.succeeds().stdout.contains("is there already"), "{}", again.stdout);
    assert_eq!(
        modified(&folder.path().join("set/shard-000000.tar")),
        first,
        "made again"
    );

    // What it says of itself is not enough: its shards have to be there, and whole.
    let shard = folder.path().join("set/shard-000003.tar");
    let bytes = fs::read(&shard).unwrap();
    fs::write(&shard, &bytes[..bytes.len() - 512]).unwrap();
    deepsft(folder.path(), &synth("set")).fails(3, &["shard-000003.tar", "should have"]);
    fs::remove_file(&shard).unwrap();
    deepsft(folder.path(), &synth("set")).fails(3, &["shard-000003.tar", "remove the data set"]);
}

#[test]
fn parts_are_read_as_one_set_when_all_are_there() {
    let folder = tempfile::tempdir().unwrap();
    write_template(folder.path(), "template");
    write_bundle(folder.path(), "model");
    let synth = |more: &str| {
        let words = format!("synth --template template --count 5 --seed 8 --images paper --shard-size 2 {more}");
        deepsft(folder.path(), &words.split(' ').collect::<Vec<_>>())
    };
    let eval = || {
        deepsft(
            folder.path(),
            &["eval", "--model", "model", "--dataset", "set", "--json", "figures.json"],
        )
    };
    let second = synth("--shard 2/2 --out set");
    assert!(
        second.succeeds().stdout.contains("others are still to be made"),
        "{}",
        second.stdout
    );
    let part = json(&folder.path().join("set/part-2-of-2/dataset.json")).unwrap();
    assert_eq!(
        (part["part"].to_string(), part["first"].as_u64()),
        ("[2,2]".to_owned(), Some(2))
    );
    eval().fails(3, &["set", "part-1-of-2 is not there yet"]);
    synth("--shard 1/3 --out set").fails(1, &["holds parts of 2"]);

    let done = synth("--shard 1/2 --out set");
    assert!(
        done.succeeds().stdout.contains("all 2 parts are there, 5 samples"),
        "{}",
        done.stdout
    );
    let shard = folder.path().join("set/part-2-of-2/shard-000001.tar");
    let bytes = fs::read(&shard).unwrap();
    fs::write(&shard, "cut").unwrap();
    synth("--shard 1/2 --out set").fails(3, &["part-2-of-2/shard-000001.tar", "should have"]);
    fs::write(&shard, bytes).unwrap();
    eval().succeeds();
    assert_eq!(
        json(&folder.path().join("figures.json")).unwrap()["frames"].as_u64(),
        Some(5)
    );

    synth("--out whole").succeeds();
    synth("--shard 1/2 --out whole").fails(1, &["holds a whole data set"]);
}

#[test]
fn presets_and_photographs_change_the_images_and_bad_photographs_are_told() {
    let folder = tempfile::tempdir().unwrap();
    write_template(folder.path(), "template");
    for name in ["photos", "none", "broken"] {
        fs::create_dir(folder.path().join(name)).unwrap();
    }
    write_photograph(&folder.path().join("photos"), "room.png");
    fs::write(folder.path().join("none/notes.txt"), "").unwrap();
    fs::write(folder.path().join("broken/half.jpg"), b"\xff\xd8\xff\xe0").unwrap();
    let synth = |more: &str| {
        let words = format!("synth --template template --count 2 --seed 8 {more}");
        deepsft(folder.path(), &words.split(' ').collect::<Vec<_>>())
    };
    synth("--backgrounds nowhere --out x").fails(3, &["folder of photographs", "nowhere"]);
    synth("--backgrounds none --out x").fails(3, &["none", "no picture in it"]);
    synth("--backgrounds broken --out x").fails(3, &["image", "half.jpg"]);
    synth("--images papier --out x").fails(2, &["papier", "default, paper"]);
    assert!(!folder.path().join("x").exists());

    let shard = |name: &str| fs::read(folder.path().join(name).join("shard-000000.tar")).unwrap();
    synth("--images paper --sheet sheet.png --out a").succeeds();
    synth("--images paper --backgrounds photos --out b").succeeds();
    synth("--images paper --camera-effects --out c").succeeds();
    synth("--out d").succeeds();
    let shards = ["a", "b", "c", "d"].map(shard);
    assert!((0..4).all(|i| (0..i).all(|j| shards[i] != shards[j])));
    assert!(folder.path().join("sheet.png").metadata().unwrap().len() > 10_000);
    // What was made with one set of options is never taken for what another would make.
    let fingerprint = |name: &str| json(&folder.path().join(name).join("dataset.json")).unwrap()["fingerprint"].clone();
    let fingerprints = ["a", "b", "c", "d"].map(fingerprint);
    assert!((0..4).all(|i| (0..i).all(|j| fingerprints[i] != fingerprints[j])));
}

#[test]
fn a_part_without_samples_has_no_sheet() {
    let folder = tempfile::tempdir().unwrap();
    write_template(folder.path(), "template");
    let synth = |part: &str| {
        let words = format!("synth --template template --count 1 --seed 8 --out set --sheet s.png --shard {part}");
        deepsft(folder.path(), &words.split(' ').collect::<Vec<_>>())
    };
    let parts = [synth("1/2"), synth("2/2")];
    let without = |run: &&crate::common::Run| run.succeeds().stdout.contains("this part has no samples: no sheet");
    assert_eq!(parts.iter().filter(without).count(), 1);
    assert!(
        parts
            .iter()
            .any(|run| run.stdout.contains("1 samples on a sheet: s.png"))
    );
}
