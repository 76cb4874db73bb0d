//! `deepsft eval`: one table of several models on several data sets, ablations, figures.

use crate::common::{deepsft, write_bundle};
use serde_json::Value;
use std::fs;
use std::path::{Path, PathBuf};

/// The model that ships.
fn poster() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../models/poster-a4")
}

fn json(path: &Path) -> Value {
    serde_json::from_slice(&fs::read(path).unwrap()).unwrap()
}

#[test]
fn two_models_on_two_data_sets_are_four_rows_that_are_what_each_is_alone() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    write_bundle(folder, "one");
    write_bundle(folder, "two");
    let simulate = [
        "recording",
        "simulate",
        "--model",
        "one",
        "--frames",
        "2",
        "--out",
        "recording",
    ];
    deepsft(folder, &simulate).succeeds();
    let synthetic = ["--synthetic", "2", "--seed", "5"];
    let models = ["eval", "--model", "one", "--model", "two", "--data", "recording"];
    let files = ["--json", "all.json", "--figure", "figure.png"];
    let run = deepsft(folder, &[&models[..], &synthetic, &files].concat());
    let table = &run.succeeds().stdout;
    assert_eq!(table.lines().next().unwrap().split_whitespace().next(), Some("model"));
    // Models of one name are told apart; a simulated recording is called so.
    for part in [
        "untrained (one)  2 synthetic frames of seed 5",
        "untrained (two)  simulated recording recording",
    ] {
        assert!(table.contains(part), "{part:?} is not in\n{table}");
    }
    let all = json(&folder.join("all.json"));
    let rows = all["rows"].as_array().unwrap();
    let names: Vec<(&str, bool)> = rows
        .iter()
        .map(|row| {
            (
                row["model"].as_str().unwrap(),
                row["set"].as_str().unwrap().contains("synthetic"),
            )
        })
        .collect();
    let (one, two) = ("untrained (one)", "untrained (two)");
    assert_eq!(names, [(one, true), (one, false), (two, true), (two, false)]);
    let alone = ["eval", "--model", "two", "--data", "recording", "--json", "alone.json"];
    deepsft(folder, &alone).succeeds();
    let alone = json(&folder.join("alone.json"));
    assert_eq!(alone["set"], "simulated recording recording, exact truth");
    for key in [
        "mask_iou",
        "depth_rmse_mm",
        "registration_rmse_px",
        "photo_consistency_error",
        "per_frame",
    ] {
        assert_eq!(rows[3][key], alone[key], "{key}");
    }
    // Eight columns of half the maps' size with gaps of 6 between them.
    let figure = deepsft::decode_picture(&fs::read(folder.join("figure.png")).unwrap()).unwrap();
    assert_eq!(figure.width(), 8 * 246 + 6);
}

#[test]
fn a_recording_without_truth_has_the_figures_that_its_depth_camera_allows() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let model = poster();
    let model = model.to_str().unwrap();
    let simulate = ["recording", "simulate", "--model", model, "--frames", "2"];
    deepsft(folder, &[&simulate[..], &["--masks", "--out", "recording"]].concat()).succeeds();
    let eval = |arguments: &[&str]| {
        let command = [
            "eval",
            "--model",
            model,
            "--data",
            "recording",
            "--json",
            "figures.json",
        ];
        deepsft(folder, &[&command[..], arguments].concat()).succeeds();
        json(&folder.join("figures.json"))
    };
    let exact = eval(&[]);
    fs::remove_dir_all(folder.join("recording/truth")).unwrap();
    let measured = eval(&["--figure", "figure.png"]);
    assert_eq!(measured["set"], "simulated recording recording, measured depth");
    for key in ["registration_rmse_px", "registration_rmse_mm"] {
        assert!(exact[key].is_number() && measured[key].is_null(), "{key}");
    }
    // The same maps: what needs no truth is the same, the masks nearly, and the sensor errs by some millimetres.
    assert_eq!(exact["photo_consistency_error"], measured["photo_consistency_error"]);
    let difference = |key: &str| (exact[key].as_f64().unwrap() - measured[key].as_f64().unwrap()).abs();
    assert!(difference("mask_iou") < 0.02 && difference("coverage") < 0.02);
    assert!(difference("depth_rmse_mm") > 0.0 && difference("depth_rmse_mm") < 20.0);
    let figure = deepsft::decode_picture(&fs::read(folder.join("figure.png")).unwrap()).unwrap();
    assert_eq!(figure.width(), 7 * 246 + 6);
    let stages = eval(&["--ablation"]);
    let names: Vec<&str> = stages["rows"]
        .as_array()
        .unwrap()
        .iter()
        .map(|row| row["stage"].as_str().unwrap())
        .collect();
    assert_eq!(
        names,
        ["main block only", "+ depth refinement", "+ registration refinement"]
    );
    assert_eq!(stages["rows"][2]["depth_rmse_mm"], measured["depth_rmse_mm"]);
}
