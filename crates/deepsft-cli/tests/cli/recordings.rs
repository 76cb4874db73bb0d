//! RGB-D recordings: simulated, checked, trained on; and what is said of broken ones.

use crate::common::{deepsft, template, write_bundle, write_bundle_of, write_files, write_template};
use deepsft::{Architecture, R50FConfig};
use deepsft_formats::encode_jpeg;
use deepsft_synth::{RecordingSimulator, encode_depth_png};
use serde_json::Value;
use std::collections::BTreeMap;
use std::fmt::Write;
use std::fs;
use std::path::{Path, PathBuf};

/// The model that ships.
fn poster() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../models/poster-a4")
}

#[test]
fn a_simulated_recording_says_so_and_steps_two_and_three_of_a_training_learn_from_it() {
    let folder = tempfile::tempdir().unwrap();
    let model = poster();
    let simulate = |frames: &str| {
        let object = ["recording", "simulate", "--model", model.to_str().unwrap()];
        let options = ["--frames", frames, "--masks", "--out", "recording"];
        deepsft(folder.path(), &[&object[..], &options].concat())
    };
    assert!(simulate("2").succeeds().stdout.starts_with("simulated recording"));
    // An older one is replaced.
    simulate("8").succeeds();
    let recording = folder.path().join("recording");
    let camera: Value = serde_json::from_slice(&fs::read(recording.join("camera.json")).unwrap()).unwrap();
    assert_eq!(camera["simulated"], Value::Bool(true));
    let readme = fs::read_to_string(recording.join("README.md")).unwrap();
    assert!(readme.starts_with("# A simulated RGB-D recording"));
    let verified = deepsft(folder.path(), &["recording", "verify", "recording"]);
    let told = &verified.succeeds().stdout;
    assert!(
        told.starts_with("simulated recording of 8 frames") && told.contains("with masks"),
        "{told}"
    );

    let train = [
        "train",
        "--steps",
        "2,3",
        "--model",
        model.to_str().unwrap(),
        "--recording",
        "recording",
    ];
    let options = ["--epochs", "1", "--out", "tuned"];
    let run = deepsft(folder.path(), &[&train[..], &options].concat());
    for part in [
        "6 frames to train on, 2 held out",
        "| before |",
        "| after step 2 |",
        "| after step 3 |",
        "| the truth itself |",
    ] {
        assert!(run.succeeds().stdout.contains(part), "{part} is not in {}", run.stdout);
    }
    let tuned = folder.path().join("tuned");
    deepsft(folder.path(), &["bundle", "verify", "tuned"]).succeeds();
    let figures: Value = serde_json::from_slice(&fs::read(tuned.join("tuning.json")).unwrap()).unwrap();
    assert_eq!(figures["recording"], "simulated recording");
    let rows = figures["rows"].as_array().unwrap();
    let median = |row: usize, figure: &str| rows[row]["figures"][figure]["median"].as_f64().unwrap();
    assert_eq!(rows.len(), 4);
    assert!(median(0, "depth_rmse_mm") < 60.0);
    // The simulated print is duller than its file.
    assert!(
        run.stdout
            .contains("the camera shows the template's red / green / blue times 0.")
    );
    for gain in figures["colors"]["gain"].as_array().unwrap() {
        assert!((0.2..0.9).contains(&gain.as_f64().unwrap()), "{gain}");
    }
    for row in [0, 3] {
        assert!(median(row, "recorded_colors_photo_consistency_error") < 0.9 * median(row, "photo_consistency_error"));
    }
    // The truth is measured over the same pixels: its registration draws the template nearer to the image.
    assert!(median(3, "depth_rmse_mm") == 0.0 && median(3, "registration_rmse_px") == 0.0);
    assert!(median(3, "relit_photo_consistency_error") < 0.9 * median(0, "relit_photo_consistency_error"));
    let card = fs::read_to_string(tuned.join("CARD.md")).unwrap();
    assert!(card.contains("Held-out end of the simulated recording") && !card.contains("synthetic images alone"));
    for file in ["step-2.csv", "step-2.png", "step-3.csv", "step-3.png"] {
        assert!(tuned.join(file).is_file(), "{file}");
    }
    // Its checkpoints are there: it is not begun anew by mistake.
    deepsft(folder.path(), &[&train[..], &options].concat()).fails(1, &["add --resume", "tuned.step-2.checkpoint"]);
}

#[test]
fn a_broken_recording_is_refused_with_its_file_and_steps_without_one_are_no_command() {
    let folder = tempfile::tempdir().unwrap();
    write_template(folder.path(), "template");
    write_bundle(folder.path(), "model");
    let simulate = [
        "recording",
        "simulate",
        "--template",
        "template",
        "--frames",
        "2",
        "--out",
        "recording",
    ];
    deepsft(folder.path(), &simulate).succeeds();
    let train = ["train", "--steps", "2", "--model", "model", "--out", "tuned"];
    let with_recording = [&train[..], &["--recording", "recording"]].concat();
    let depth = folder.path().join("recording/depth/000001.png");
    let bytes = fs::read(&depth).unwrap();
    fs::write(&depth, &bytes[..bytes.len() / 2]).unwrap();
    for command in [&with_recording[..], &["recording", "verify", "recording"]] {
        deepsft(folder.path(), command).fails(3, &["cannot use recording", "depth/000001.png"]);
    }
    fs::remove_file(&depth).unwrap();
    deepsft(folder.path(), &with_recording).fails(3, &["000001.jpg", "no partner"]);
    deepsft(folder.path(), &train).fails(2, &["need --recording"]);
    // R50F has no blocks that these steps could train; the recording is not even looked at.
    write_bundle_of(folder.path(), "r50f", Architecture::R50F(R50FConfig::narrow(64)));
    let without_blocks = with_recording
        .iter()
        .map(|word| if *word == "model" { "r50f" } else { *word });
    deepsft(folder.path(), &without_blocks.collect::<Vec<_>>()).fails(3, &["model bundle r50f", "no depth refinement"]);
    assert!(!folder.path().join("tuned").exists());
    // Somebody's own recording is not replaced by a simulated one.
    fs::remove_dir_all(folder.path().join("recording/truth")).unwrap();
    assert_ne!(deepsft(folder.path(), &simulate).code, 0);
}

#[test]
fn all_three_steps_are_one_command_from_a_template_to_a_bundle() {
    let folder = tempfile::tempdir().unwrap();
    write_template(folder.path(), "template");
    let simulate = [
        "recording",
        "simulate",
        "--template",
        "template",
        "--frames",
        "8",
        "--changing-place",
    ];
    deepsft(folder.path(), &[&simulate[..], &["--out", "recording"]].concat()).succeeds();
    let steps = ["train", "--steps", "1,2,3", "--template", "template"];
    let options = [
        "--recording",
        "recording",
        "--samples",
        "32",
        "--accuracy-frames",
        "8",
        "--epochs",
        "1",
        "--light",
        "ignored",
        "--out",
        "three",
    ];
    let run = deepsft(folder.path(), &[&steps[..], &options].concat());
    for part in [
        " 0 samples",
        " 32 samples",
        "| before |",
        "| after step 2 |",
        "| after step 3 |",
    ] {
        assert!(run.succeeds().stdout.contains(part), "{part} is not in {}", run.stdout);
    }
    let readme = fs::read_to_string(folder.path().join("recording/README.md")).unwrap();
    assert!(readme.contains("camera settings: others in every take"), "{readme}");
    let three = folder.path().join("three");
    deepsft(folder.path(), &["bundle", "verify", "three"]).succeeds();
    let card = fs::read_to_string(three.join("CARD.md")).unwrap();
    for part in [
        "Trained on synthetic images and tuned",
        "| 0 | 0.00 | - |",
        "| after step 3 |",
    ] {
        assert!(card.contains(part), "{part} is not in {card}");
    }
    for file in ["curve.csv", "curve.png", "step-2.csv", "step-3.png", "tuning.json"] {
        assert!(three.join(file).is_file(), "{file}");
    }
}

/// Writes a recording of four frames as Open3D does, the last without its depth picture, and the vertices of each in metres.
fn write_scene(folder: &Path) {
    let simulator = RecordingSimulator::new(&template(), false, 3).unwrap();
    let (take, camera) = (simulator.take(0), simulator.sensor().color);
    let mut files = BTreeMap::new();
    for index in 0..4 {
        let frame = take.frame(index).unwrap();
        let jpeg = encode_jpeg(&frame.color.image, 92).unwrap();
        files.insert(format!("color/{index:06}.jpg"), jpeg);
        let depth: Vec<u16> = frame
            .color
            .truth
            .depth()
            .iter()
            .map(|mm| mm.max(0.0).round() as u16)
            .collect();
        files.insert(
            format!("depth/{index:06}.png"),
            encode_depth_png(&depth, &camera).unwrap(),
        );
        let vertices = frame.color.vertices_camera.iter().map(|p| p / 1000.0);
        let rows = vertices.fold(String::new(), |mut rows, p| {
            let _ = writeln!(rows, "{} {} {}", p.x, p.y, p.z);
            rows
        });
        files.insert(format!("points/{index}.txt"), rows.into_bytes());
    }
    files.remove("depth/000003.png");
    let (focal, centre) = (camera.focal(), camera.principal_point() - 0.5);
    let intrinsics = serde_json::json!({
        "width": camera.size().width,
        "height": camera.size().height,
        "intrinsic_matrix": [focal.x, 0, 0, 0, focal.y, 0, centre.x, centre.y, 1],
    });
    files.insert("camera_intrinsic.json".to_owned(), intrinsics.to_string().into_bytes());
    write_files(&folder.join("scene"), &files);
}

#[test]
fn a_recording_of_another_program_is_imported_checked_and_measured_on() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    write_template(folder, "template");
    write_bundle(folder, "model");
    write_scene(folder);
    let scene =
        "recording import --color scene/color --depth scene/depth --camera scene/camera_intrinsic.json --out recording";
    let run = |options: &str| {
        let words = scene.split(' ').chain(options.split_ascii_whitespace());
        deepsft(folder, &words.collect::<Vec<_>>())
    };
    let imported = run("");
    assert_eq!(imported.succeeds().stdout, "recording, 3 frames: recording\n");
    assert_eq!(
        imported.stderr,
        "note: left out, without a partner: scene/color/000003.jpg\n"
    );
    let verified = deepsft(folder, &["recording", "verify", "recording"]);
    let told = &verified.succeeds().stdout;
    assert!(
        told.starts_with("recording of 3 frames, colour 960 x 540, depth 960 x 540 (registered)"),
        "{told}"
    );
    // An older import is replaced, and the truth comes with it.
    let truth = run("--template template --truth scene/points --truth-unit m");
    assert!(
        truth
            .succeeds()
            .stdout
            .contains("its truth, a data set: recording/truth"),
        "{}",
        truth.stdout
    );
    deepsft(folder, &["eval", "--model", "model", "--data", "recording/truth"]).succeeds();
    run("--truth scene/points").fails(2, &["--model <BUNDLE>|--template <DIR>"]);
    run("--template template").fails(2, &["--truth"]);
    run("--template template --truth scene/points")
        .fails(3, &["cannot use truth scene/points/0.txt", "correct the unit"]);
    fs::copy(
        folder.join("scene/color/000001.jpg"),
        folder.join("scene/depth/000001.png"),
    )
    .unwrap();
    run("").fails(
        3,
        &[
            "cannot use depth picture scene/depth/000001.png",
            "16-bit grey, this one is Rgb8",
        ],
    );
    // The older import is whole, and what is no import is somebody's own.
    deepsft(folder, &["recording", "verify", "recording"]).succeeds();
    fs::remove_file(folder.join("recording/imported.csv")).unwrap();
    run("").fails(1, &["recording exists and holds no imported.csv"]);
}
