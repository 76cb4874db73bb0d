//! Bad input: every refusal names the file and the cause, with the documented exit code.

use crate::common::{Run, deepsft, write_bundle, write_photograph, write_template};
use deepsft::encode_png;
use deepsft_formats::FolderLock;
use deepsft_geometry::Picture;
use std::fs;
use std::path::Path;

const FAILED: i32 = 1;
const USAGE: i32 = 2;
const INVALID_INPUT: i32 = 3;

const CAMERA: &str = r#"{"width": 640, "height": 360, "fx": 500.0, "fy": 500.0, "cx": 320.0, "cy": 180.0}"#;

/// A PNG file that announces `side` x `side` pixels: the header of a small one, altered.
fn announcing(side: u32) -> Vec<u8> {
    let small = encode_png(&Picture::from_fn(1, 1, |_, _| [0; 3])).unwrap();
    let mut header = small[12..29].to_vec();
    header[4..8].copy_from_slice(&side.to_be_bytes());
    header[8..12].copy_from_slice(&side.to_be_bytes());
    // The CRC-32 of the PNG specification, over the chunk's type and content.
    let crc = !header.iter().fold(u32::MAX, |crc, &byte| {
        (0..8).fold(crc ^ u32::from(byte), |crc, _| {
            if crc & 1 == 1 { crc >> 1 ^ 0xEDB8_8320 } else { crc >> 1 }
        })
    });
    [&small[..12], &header, &crc.to_be_bytes(), &small[33..]].concat()
}

fn reconstruct(folder: &Path, extra: &[&str]) -> Run {
    deepsft(
        folder,
        &[&["reconstruct", "--model", "model", "--out", "results"], extra].concat(),
    )
}

#[test]
fn an_image_that_is_none_is_refused_with_its_name_and_the_cause() {
    let folder = tempfile::tempdir().unwrap();
    write_bundle(folder.path(), "model");
    write_photograph(folder.path(), "good.png");
    let cut = fs::read(folder.path().join("good.png")).unwrap();
    for (name, bytes, cause) in [
        ("empty.png", Vec::new(), "empty (0 bytes)"),
        ("huge.png", announcing(20_000), "20000 x 20000 pixels is too large"),
        ("text.jpg", b"hello".to_vec(), "no kind that is read: PNG, JPEG"),
        ("cut.png", cut[..cut.len() / 2].to_vec(), "cannot be read"),
    ] {
        fs::write(folder.path().join(name), bytes).unwrap();
        let new = [
            "template",
            "new",
            "--image",
            name,
            "--size-mm",
            "20x10",
            "--out",
            "template",
        ];
        deepsft(folder.path(), &new).fails(INVALID_INPUT, &[name, cause]);
        assert!(!folder.path().join("template").exists());
        reconstruct(folder.path(), &[name]).fails(INVALID_INPUT, &[name, cause]);
    }
    let new = [
        "template",
        "new",
        "--image",
        "none.png",
        "--size-mm",
        "20x10",
        "--out",
        "template",
    ];
    deepsft(folder.path(), &new).fails(INVALID_INPUT, &["none.png", "no such file"]);
}

#[test]
fn one_bad_image_among_good_ones_does_not_stop_them() {
    let folder = tempfile::tempdir().unwrap();
    write_bundle(folder.path(), "model");
    write_photograph(folder.path(), "a.png");
    fs::write(folder.path().join("b.png"), []).unwrap();
    write_photograph(folder.path(), "c.png");
    reconstruct(folder.path(), &["a.png", "b.png", "c.png"]).fails(INVALID_INPUT, &["b.png"]);
    let done = |name: &str| folder.path().join("results").join(name).join("report.json").is_file();
    assert_eq!([done("a"), done("b"), done("c")], [true, false, true]);
    // Each has its line, and what cannot be read counts however the last one ends.
    let busy = FolderLock::acquire(&folder.path().join("results/c")).unwrap();
    let run = reconstruct(folder.path(), &["b.png", "a.png", "c.png"]);
    run.fails(INVALID_INPUT, &["b.png", "another process"]);
    let (told, failed) = (
        run.stdout.lines().count(),
        run.stderr.lines().filter(|line| line.starts_with("error: ")).count(),
    );
    assert_eq!((told, failed), (1, 2), "{run:?}");
    drop(busy);
}

#[test]
fn a_camera_file_that_describes_no_camera_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    write_bundle(folder.path(), "model");
    write_photograph(folder.path(), "a.png");
    for (content, cause) in [
        (CAMERA.replace("\"fx\": 500.0", "\"fx\": 0"), "fx is 0"),
        (CAMERA.replace("\"fx\": 500.0", "\"fx\": NaN"), "line 1 column"),
        (CAMERA.replace("\"cy\": 180.0", "\"cy\": 1e999"), "out of range"),
        (CAMERA[..50].to_owned(), "EOF"),
        (String::new(), "it is empty"),
        (
            CAMERA.replace("360", "480"),
            "it is for images of 640 x 480 pixels, this one has 640 x 360",
        ),
    ] {
        fs::write(folder.path().join("camera.json"), content).unwrap();
        reconstruct(folder.path(), &["--camera", "camera.json", "a.png"])
            .fails(INVALID_INPUT, &["camera file camera.json", cause]);
    }
    assert!(!folder.path().join("results/a").exists());
    fs::write(folder.path().join("camera.json"), CAMERA).unwrap();
    reconstruct(folder.path(), &["--camera", "camera.json", "a.png"]).succeeds();
}

#[test]
fn a_template_needs_a_size() {
    let folder = tempfile::tempdir().unwrap();
    write_photograph(folder.path(), "a.png");
    let new = ["template", "new", "--image", "a.png", "--out", "template"];
    deepsft(folder.path(), &new).fails(USAGE, &["--size-mm"]);
    for size in ["0x210", "A4", "0", "NaNx210"] {
        let sized = [&new[..], &["--size-mm", size]].concat();
        deepsft(folder.path(), &sized).fails(USAGE, &["--size-mm", "297x210"]);
    }
    assert!(!folder.path().join("template").exists());

    write_template(folder.path(), "template");
    let description = folder.path().join("template/template.json");
    let json = fs::read_to_string(&description).unwrap();
    let synth = [
        "synth",
        "--template",
        "template",
        "--count",
        "1",
        "--seed",
        "1",
        "--out",
        "set",
    ];
    for (from, to, cause) in [
        ("\"width_mm\"", "\"width\"", "missing field `width_mm`"),
        ("200.0", "0.0", "width is 0 mm"),
    ] {
        assert!(json.contains(from));
        fs::write(&description, json.replace(from, to)).unwrap();
        deepsft(folder.path(), &synth).fails(INVALID_INPUT, &["template", cause]);
    }
    assert!(!folder.path().join("set").exists());
}

#[test]
fn a_bundle_that_is_not_whole_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    write_bundle(folder.path(), "model");
    write_photograph(folder.path(), "a.png");
    let path = |name: &str| folder.path().join("model").join(name);
    let verify = || deepsft(folder.path(), &["bundle", "verify", "model"]);
    assert!(verify().succeeds().stdout.contains("whole and working"));

    let weights = fs::read(path("weights.bpk")).unwrap();
    let refused = |cause: &str| {
        verify().fails(INVALID_INPUT, &["model bundle model", cause]);
        reconstruct(folder.path(), &["a.png"]).fails(INVALID_INPUT, &["model bundle model", cause]);
        let eval = ["eval", "--model", "model", "--synthetic", "1", "--seed", "1"];
        deepsft(folder.path(), &eval).fails(INVALID_INPUT, &["model bundle model", cause]);
    };
    fs::write(path("weights.bpk"), &weights[..weights.len() / 2]).unwrap();
    refused("weights.bpk of the model bundle has");
    let mut altered = weights.clone();
    altered[weights.len() / 2] ^= 1;
    fs::write(path("weights.bpk"), altered).unwrap();
    refused("SHA-256 differs");
    fs::remove_file(path("weights.bpk")).unwrap();
    refused("lacks weights.bpk");
    fs::write(path("weights.bpk"), weights).unwrap();
    verify().succeeds();

    let json = fs::read_to_string(path("model.json")).unwrap();
    let listing = |name: &str| json.replace("\"weights.bpk\"", &format!("{name:?}"));
    fs::write(path("model.json"), listing("../../weights.bpk")).unwrap();
    refused("outside of its folder");
    fs::write(
        path("model.json"),
        json.replace("\"format_version\": 1", "\"format_version\": 2"),
    )
    .unwrap();
    refused("format version 2, this program reads version 1");
    fs::write(path("model.json"), &json[..json.len() / 2]).unwrap();
    refused("model.json of the model bundle cannot be used");
}

#[test]
fn a_folder_of_another_kind_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    write_bundle(folder.path(), "model");
    fs::create_dir(folder.path().join("mine")).unwrap();
    fs::write(folder.path().join("mine/thesis.tex"), "years of work").unwrap();
    let run = |arguments: &[&str]| deepsft(folder.path(), arguments);
    run(&["bundle", "verify", "mine"]).fails(INVALID_INPUT, &["mine", "lacks model.json"]);
    run(&["bundle", "verify", "nowhere"]).fails(INVALID_INPUT, &["nowhere", "no such folder"]);
    run(&["train", "--template", "mine", "--out", "b"]).fails(INVALID_INPUT, &["mine", "template.json"]);
    run(&["eval", "--model", "model", "--dataset", "mine"]).fails(INVALID_INPUT, &["mine", "dataset.json"]);
    // Nor is anything written over it.
    write_template(folder.path(), "template");
    for command in [
        [
            "synth",
            "--template",
            "template",
            "--count",
            "1",
            "--seed",
            "1",
            "--out",
            "mine",
        ]
        .as_slice(),
        &["train", "--template", "template", "--samples", "16", "--out", "mine"],
    ] {
        run(command).fails(FAILED, &["mine exists and holds no"]);
    }
    assert_eq!(
        fs::read_to_string(folder.path().join("mine/thesis.tex")).unwrap(),
        "years of work"
    );
}

#[test]
fn contradictions_on_the_command_line_are_usage_errors() {
    let folder = tempfile::tempdir().unwrap();
    let run = |arguments: &[&str]| deepsft(folder.path(), arguments);
    run(&["eval", "--model", "m"]).fails(USAGE, &["--synthetic", "--data"]);
    run(&["eval", "--model", "m", "--synthetic", "5"]).fails(USAGE, &["--seed"]);
    let both = [
        "eval",
        "--model",
        "m",
        "--synthetic",
        "5",
        "--seed",
        "1",
        "--ablation",
        "--mesh",
        "fit",
    ];
    run(&both).fails(USAGE, &["cannot be used with"]);
    let on_disk = ["eval", "--model", "m", "--data", "d", "--images", "paper"];
    run(&on_disk).fails(USAGE, &["--images", "for --synthetic"]);
    let sheet = ["eval", "--model", "m", "--data", "d", "--data", "e", "--sheet", "s.png"];
    run(&sheet).fails(USAGE, &["one model on one data set"]);
    let both = [
        "train",
        "--template",
        "t",
        "--out",
        "b",
        "--minutes",
        "1",
        "--samples",
        "5",
    ];
    run(&both).fails(USAGE, &["cannot be used with"]);
    run(&["train", "--template", "t", "--out", "b", "--minutes", "-1"]).fails(USAGE, &[]);
    run(&["train", "--template", "t", "--out", "b", "--device", "abacus"]).fails(USAGE, &["abacus", "cpu"]);
    run(&["reconstruct", "--model", "m", "--out", "o"]).fails(USAGE, &["IMAGE"]);
    run(&["reconstruct", "--model", "m", "--out", "o", "a/x.png", "b/x.png"]).fails(USAGE, &["o/x"]);
    let names = ["a/x.png", "b/y.png", "c/x.jpg"];
    run(&[&["reconstruct", "--model", "m", "--out", "out"], &names[..]].concat()).fails(USAGE, &["out/x:"]);
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0);
}

#[test]
fn a_checkpoint_is_not_overwritten_by_accident() {
    let folder = tempfile::tempdir().unwrap();
    write_template(folder.path(), "template");
    fs::create_dir(folder.path().join("model.checkpoint")).unwrap();
    let train = ["train", "--template", "template", "--out", "model", "--samples", "16"];
    deepsft(folder.path(), &train).fails(FAILED, &["model.checkpoint", "--resume"]);
}

#[test]
fn a_folder_on_which_another_process_works_is_left_alone() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    write_template(folder, "template");
    let run = |line: &str| deepsft(folder, &line.split(' ').collect::<Vec<_>>());
    run("clip --template template --frames 2 --out film").succeeds();
    let commands = [
        ("synth --template template --count 1 --seed 1 --out set", "set"),
        ("train --template template --samples 16 --out model", "model"),
        ("clip --template template --frames 1 --out clip", "clip"),
        ("track --template template --out track film", "track"),
        (
            "reconstruct --template template --out results film/frame-00000.png",
            "results/frame-00000",
        ),
        (
            "recording simulate --template template --frames 1 --out record",
            "record",
        ),
        (
            "template new --image template/texture.png --size-mm 200x150 --out sheet",
            "sheet",
        ),
    ];
    // This process is the other one.
    let at_work = commands.map(|(_, place)| FolderLock::acquire(&folder.join(place)).unwrap());
    for (line, place) in commands {
        run(line).fails(FAILED, &["another process", place]);
        assert!(!folder.join(place).exists(), "{line}");
    }
    drop(at_work);
    run(commands[0].0).succeeds();
}
