//! `deepsft train --data`: step 1 on what `deepsft synth` wrote.

use crate::common::{deepsft, template, write_files, write_template};
use deepsft::template_to_files;
use deepsft_geometry::{Picture, Template};
use serde_json::Value;
use std::fs;

const FAILED: i32 = 1;
const USAGE: i32 = 2;
const INVALID_INPUT: i32 = 3;

#[test]
fn a_training_on_data_sets_makes_a_bundle_and_goes_on_with_no_others() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let run = |line: &str| deepsft(folder, &line.split(' ').collect::<Vec<_>>());
    write_template(folder, "template");
    for (count, seed, out) in [(10, 5, "set"), (6, 6, "parts --shard 1/2"), (6, 6, "parts --shard 2/2")] {
        let synth = format!("synth --template template --count {count} --seed {seed} --shard-size 4 --out {out}");
        run(&synth).succeeds();
    }

    let train = "train --template template --out model --samples 16 --accuracy-frames 8 --images paper --data set";
    let trained = run(&format!("{train} --data parts"));
    let told = &trained.succeeds().stdout;
    assert!(
        told.contains("data sets: 15 samples to train on, 1 held out at the end"),
        "{told}"
    );
    run("bundle verify model").succeeds();
    let card = fs::read_to_string(folder.join("model/CARD.md")).unwrap();
    assert!(
        card.contains(
            "| training images | data set set (10 samples of seed 5), data set parts (6 samples of seed 6), the last 1 held out |"
        ),
        "{card}"
    );
    assert!(card.contains("made on the fly, the paper's ranges"), "{card}");

    // Another data set, none, and another preset.
    for (other, what) in [
        (train.to_owned(), "other training images"),
        (train.replace(" --data set", ""), "other training images"),
        (format!("{train} --data parts --preset paper"), "another preset"),
    ] {
        run(&format!("{other} --resume"))
            .fails(FAILED, &["checkpoint was made with another", what, "model.checkpoint"]);
    }
}

#[test]
fn data_sets_that_cannot_be_trained_on_are_told_before_the_training_begins() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let run = |line: &str| deepsft(folder, &line.split(' ').collect::<Vec<_>>());
    write_template(folder, "template");
    run("synth --template template --count 10 --seed 5 --shard-size 5 --out set").succeeds();
    run("synth --template template --count 9 --seed 6 --shard-size 9 --out few").succeeds();
    run("synth --template template --count 1 --seed 51739 --out measured").succeeds();
    let wide = Template::thin_shell(template().texture().clone(), 210.0, 150.0).unwrap();
    write_files(&folder.join("wide"), &template_to_files(&wide).unwrap());
    fs::create_dir(folder.join("begun.partial")).unwrap();
    fs::create_dir(folder.join("recording")).unwrap();
    fs::write(folder.join("recording/camera.json"), "{}").unwrap();

    let train = |more: &str| run(&format!("train --out model --samples 16 {more}"));
    let fails =
        |data: &str, parts: &[&str]| train(&format!("--template template --data {data}")).fails(INVALID_INPUT, parts);
    fails("nowhere", &["nowhere", "dataset.json"]);
    fails("few", &["data set few", "9 samples are too few", "10 at least"]);
    fails(
        "begun",
        &["data set begun", "not finished", "begun.partial", "deepsft synth"],
    );
    fails("recording", &["data set recording", "RGB-D recording", "--recording"]);
    fails("measured", &["data set measured", "seed 51739", "accuracy"]);
    fails("set --data set", &["sample 0 of seed 5 is in two"]);
    train("--template wide --data set").fails(INVALID_INPUT, &["data set set", "200 x 150 mm, not 210 x 150 mm"]);
    let mut other = template().texture().rgb().to_vec();
    other[0] ^= 1;
    let texture = template().texture().clone();
    let other = Picture::new(texture.width(), texture.height(), other).unwrap();
    let other = Template::thin_shell(other, 200.0, 150.0).unwrap();
    write_files(&folder.join("other"), &template_to_files(&other).unwrap());
    train("--template other --data set").fails(INVALID_INPUT, &["data set set", "another template", "texture"]);
    run("train --out model --model m --steps 2 --recording recording --data set").fails(USAGE, &["for step 1"]);

    // Cut, and with a size that is right but a sample that is missing.
    let shard = folder.join("set/shard-000001.tar");
    let bytes = fs::read(&shard).unwrap();
    fs::write(&shard, &bytes[..bytes.len() - 512]).unwrap();
    fails("set", &["shard-000001.tar", "should have"]);
    let mut empty_after_the_first = bytes;
    let header = b"000001.rgb.png";
    let second = empty_after_the_first
        .windows(header.len())
        .position(|name| name == header);
    empty_after_the_first[second.unwrap()..].fill(0);
    fs::write(&shard, empty_after_the_first).unwrap();
    fails("set", &["shard-000001.tar", "its SHA-256 differs"]);
    // A set without hashes.
    let description = folder.join("set/dataset.json");
    let mut json: Value = serde_json::from_slice(&fs::read(&description).unwrap()).unwrap();
    json.as_object_mut().unwrap().remove("shard_sha256").unwrap();
    fs::write(&description, json.to_string()).unwrap();
    fails("set", &["data set set", "hold 6 samples, its description says 10"]);
    assert!(!folder.join("model").exists() && !folder.join("model.checkpoint").exists());
}
