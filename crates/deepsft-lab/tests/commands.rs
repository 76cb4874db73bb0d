//! Every command of the lab on small input, run as users run it.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use deepsft::decode_picture;
use deepsft_geometry::Topology;
use serde_json::Value;
use std::collections::BTreeMap;
use std::fs;
use std::path::Path;
use std::process::Command;

/// What a run of the command left behind.
#[derive(Debug)]
struct Run {
    code: i32,
    stdout: String,
    stderr: String,
}

/// Runs `deepsft-lab` in `folder`.
fn deepsft_lab(folder: &Path, arguments: &[&str]) -> Run {
    let output = Command::new(env!("CARGO_BIN_EXE_deepsft-lab"))
        .args(arguments)
        .current_dir(folder)
        .output()
        .unwrap();
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    Run {
        code: output.status.code().unwrap(),
        stdout: text(&output.stdout),
        stderr: text(&output.stderr),
    }
}

impl Run {
    /// Checks that the run failed with `code` and reported each of `parts`.
    fn fails(&self, code: i32, parts: &[&str]) {
        assert_eq!(self.code, code, "{self:?}");
        for part in parts {
            assert!(self.stderr.contains(part), "{part:?} is not in: {}", self.stderr);
        }
        assert!(!self.stderr.contains("panicked"), "{}", self.stderr);
    }

    /// Checks that the run succeeded.
    fn succeeds(&self) -> &Self {
        assert_eq!(self.code, 0, "{self:?}");
        self
    }
}

fn shipped_model() -> String {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../models/poster-a4");
    path.to_str().unwrap().to_owned()
}

fn json(path: &Path) -> Value {
    serde_json::from_slice(&fs::read(path).unwrap()).unwrap()
}

#[test]
fn completion_is_measured_and_its_worst_frames_are_drawn() {
    let folder = tempfile::tempdir().unwrap();
    let arguments = ["completion", "accuracy", "--frames", "12", "--seed", "3"];
    let files = ["--json", "completion.json", "--sheet", "completion.png"];
    let run = deepsft_lab(folder.path(), &[&arguments[..], &files[..]].concat());
    assert!(run.succeeds().stdout.contains("poster") && run.stdout.contains("closed"));
    let report = json(&folder.path().join("completion.json"));
    for object in 0..2 {
        let object = &report["objects"][object];
        assert_eq!(object["per_frame"].as_array().unwrap().len(), 12);
        let figure = |name: &str| object["all"][name].as_f64().unwrap();
        assert!(figure("arap_mm") > 0.0 && figure("arap_mm") < figure("rigid_mm"));
    }
    let sheet = decode_picture(&fs::read(folder.path().join("completion.png")).unwrap()).unwrap();
    assert!(sheet.width() > 5 * 240 && sheet.height() > 12 * 135);
}

#[test]
fn a_study_has_every_level_of_every_series_and_draws_them() {
    let folder = tempfile::tempdir().unwrap();
    let model = shipped_model();
    let outputs = ["--json", "study.json", "--plot", "study.png", "--sheet", "worst.png"];
    let arguments = ["study", "fit", "--model", &model, "--frames", "1", "--seed", "31"];
    let run = deepsft_lab(folder.path(), &[&arguments[..], &outputs].concat());
    assert!(run.succeeds().stdout.contains("| px | found |"), "{}", run.stdout);
    let study = json(&folder.path().join("study.json"));
    let series = study["series"].as_array().unwrap();
    assert_eq!(series.len(), 10);
    let errors = &series[0];
    assert_eq!(errors["start"].as_str(), Some("disturbed-truth"));
    for row in errors["rows"].as_array().unwrap() {
        let level = row["level"].as_f64().unwrap();
        let started = row["start"]["median"]["registration_rmse_px"].as_f64().unwrap();
        assert!((started - level).abs() < 0.01, "{row}");
        assert!(
            row["fitted"]["median"]["rmse_3d_mm"].is_number() && row["found"] == 1,
            "{row}"
        );
    }
    for name in ["study.png", "worst.png"] {
        let picture = decode_picture(&fs::read(folder.path().join(name)).unwrap()).unwrap();
        assert!(picture.width() > 480, "{name}");
    }
}

/// A GoPro's image is 59 degrees across and the training camera's 65: without the warp depths are off by a sixth.
#[test]
fn one_scene_is_measured_through_all_cameras_with_and_without_the_warp() {
    let folder = tempfile::tempdir().unwrap();
    let model = shipped_model();
    let arguments = [
        "study",
        "cameras",
        "--model",
        &model,
        "--scenes",
        "1",
        "--near-scenes",
        "0",
    ];
    let files = ["--json", "cameras.json", "--figure", "cameras.png"];
    let run = deepsft_lab(folder.path(), &[&arguments[..], &files].concat());
    assert!(run.succeeds().stdout.contains("wide-phone, upright"), "{}", run.stdout);
    let report = json(&folder.path().join("cameras.json"));
    let rows = report["cameras"].as_array().unwrap();
    assert_eq!((rows.len(), report["near"].as_array().unwrap().len()), (20, 6));
    let row = |camera: &str, is_warped: bool| {
        let is_it =
            |row: &&Value| row["camera"] == camera && row["is_warped"] == is_warped && row["is_upright"] == false;
        rows.iter().find(is_it).unwrap()
    };
    let depth = |row: &Value| row["fitted"]["depth_mm"]["median"].as_f64().unwrap();
    for camera in ["training", "kinect-v2", "realsense-d435", "gopro-hero3", "wide-phone"] {
        assert_eq!(row(camera, true)["found"], 1, "{camera}");
    }
    assert_eq!(depth(row("training", true)), depth(row("training", false)));
    assert!(
        depth(row("gopro-hero3", false)) > 3.0 * depth(row("gopro-hero3", true)),
        "{report}"
    );
    let sheet = decode_picture(&fs::read(folder.path().join("cameras.png")).unwrap()).unwrap();
    assert!(sheet.width() > 5 * 240 && sheet.height() > 5 * 135);
}

#[test]
fn the_study_of_a_few_clips_has_its_figures_and_its_picture() {
    let folder = tempfile::tempdir().unwrap();
    let model = shipped_model();
    let study = [
        "study", "tracking", "--model", &model, "--clips", "1", "--frames", "30", "--event", "still",
    ];
    let files = ["--json", "figures.json", "--sheet", "figures.png"];
    let run = deepsft_lab(folder.path(), &[&study[..], &files].concat());
    assert!(
        run.succeeds().stdout.contains("jitter of a still sheet"),
        "{}",
        run.stdout
    );
    let figures = json(&folder.path().join("figures.json"));
    assert_eq!(
        (figures["clips"].as_u64(), figures["frames"].as_u64()),
        (Some(1), Some(30))
    );
    assert!(
        figures["tracked_fraction_after_answer"].as_f64().unwrap() > 0.9,
        "{figures}"
    );
    assert_eq!(figures["per_clip"][0]["frames"].as_array().unwrap().len(), 30);
    // A pixel is five times what a still sheet may jitter by.
    assert!(figures["jitter_px"][0]["most"].as_f64().unwrap() < 1.0);
    let sheet = decode_picture(&fs::read(folder.path().join("figures.png")).unwrap()).unwrap();
    assert!(sheet.width() > 4 * 480 && sheet.height() > 270);
    deepsft_lab(folder.path(), &[&study[..8], &["--event", "earthquake"]].concat()).fails(2, &["jump-cut"]);
}

#[test]
fn the_toy_is_written_as_a_template() {
    let folder = tempfile::tempdir().unwrap();
    let run = deepsft_lab(folder.path(), &["toy", "--out", "toy"]);
    assert!(run.succeeds().stdout.contains("views.png"));
    let files: BTreeMap<String, u64> = (fs::read_dir(folder.path().join("toy")).unwrap())
        .map(|entry| {
            let entry = entry.unwrap();
            (
                entry.file_name().into_string().unwrap(),
                entry.metadata().unwrap().len(),
            )
        })
        .collect();
    assert_eq!(
        files.keys().collect::<Vec<_>>(),
        ["mesh.obj", "template.json", "texture.png", "views.png"]
    );
    let toy = deepsft_formats::read_template(&folder.path().join("toy")).unwrap();
    assert_eq!(Topology::of(toy.mesh()).unwrap().genus(), Some(0));
    assert!(toy.mesh().faces().len() > 5000);
}

#[test]
fn the_poster_is_written_as_a_template_and_a_page_and_over_nothing_else() {
    let folder = tempfile::tempdir().unwrap();
    deepsft_lab(folder.path(), &["poster", "--out", "poster"]).succeeds();
    let poster = deepsft_formats::read_template(&folder.path().join("poster")).unwrap();
    assert_eq!(poster.size_mm().to_array(), [297.0, 210.0]);
    assert!(
        fs::read(folder.path().join("poster/poster-a4.pdf"))
            .unwrap()
            .starts_with(b"%PDF")
    );
    fs::create_dir(folder.path().join("mine")).unwrap();
    fs::write(folder.path().join("mine/thesis.tex"), "years of work").unwrap();
    deepsft_lab(folder.path(), &["poster", "--out", "mine"]).fails(1, &["mine exists and holds no"]);
}

#[test]
fn a_forward_pass_is_timed() {
    let folder = tempfile::tempdir().unwrap();
    let run = deepsft_lab(folder.path(), &["network-time", &shipped_model(), "--passes", "1"]);
    let text = &run.succeeds().stdout;
    assert!(
        text.contains("by burn") && text.contains("by our executor") && text.contains("peak memory"),
        "{text}"
    );
    deepsft_lab(folder.path(), &["network-time", "vgg"]).fails(3, &["vgg", "no such folder"]);
}

#[test]
fn finding_is_studied_by_kind_of_print() {
    let folder = tempfile::tempdir().unwrap();
    let few = [
        "study",
        "finding",
        "--prints",
        "2",
        "--repetitive",
        "2",
        "--frames",
        "1",
        "--absent",
        "1",
    ];
    let run = deepsft_lab(
        folder.path(),
        &[&few[..], &["--seed", "5", "--json", "finding.json"]].concat(),
    );
    let kinds = [
        "photograph-like",
        "graphic",
        "text, line art",
        "repetitive",
        "4 targets",
    ];
    assert!(kinds.iter().all(|kind| run.succeeds().stdout.contains(kind)), "{run:?}");
    let report = json(&folder.path().join("finding.json"));
    let frames = report["frames"].as_array().unwrap();
    assert_eq!(frames.len(), 16);
    let explained = |print: usize, shown: bool| {
        let frame = frames
            .iter()
            .find(|frame| frame["print"] == print && frame["shown"] == shown)
            .unwrap();
        frame["attempts"][0]["explained"].as_f64().unwrap()
    };
    // The last two are repetitive: they may not be found.
    for print in 0..6 {
        assert!(
            explained(print, true) > explained(print, false),
            "print {print}: {run:?}"
        );
    }
    let one = ["study", "finding", "--kinds", "graphic", "--prints", "1", "--seed", "5"];
    deepsft_lab(folder.path(), &one).fails(1, &["two prints"]);
}

#[test]
#[cfg(target_os = "linux")]
fn a_soak_tracks_its_clips_and_keeps_the_memory_of_every_window() {
    let folder = tempfile::tempdir().unwrap();
    let template = format!("{}/template", shipped_model());
    let length = [
        "--frames",
        "40",
        "--warm-up",
        "16",
        "--window",
        "20",
        "--clip-frames",
        "4",
        "--delay",
        "1",
    ];
    let soak = ["soak", "--template", &template, "--json", "soak.json"];
    // So few frames say nothing of memory.
    let most = ["--max-growth-kb", "1000000"];
    let run = deepsft_lab(folder.path(), &[&soak[..], &length, &most].concat());
    assert!(run.succeeds().stdout.contains("40 frames"), "{run:?}");
    let report = json(&folder.path().join("soak.json"));
    assert_eq!((&report["frames"], &report["finished"]), (&40.into(), &true.into()));
    let windows = report["windows"].as_array().unwrap();
    assert_eq!(windows.len(), 2);
    for window in windows {
        assert!(window["resident_kb"].as_u64() >= window["anonymous_kb"].as_u64());
        assert!(window["anonymous_kb"].as_u64().unwrap() > 10_000, "{window}");
    }
}

#[test]
#[cfg(any(target_os = "linux", target_os = "macos"))]
fn commands_that_are_killed_anywhere_and_as_folders_come_to_their_places_end_as_if_they_had_not_been() {
    let folder = tempfile::tempdir().unwrap();
    let template = format!("{}/template", shipped_model());
    let kills = ["--kills", "1", "--at-the-end", "1", "--seed", "5"];
    let commands = ["kills", "--command", "synth,track,clip", "--template", &template];
    let run = deepsft_lab(
        folder.path(),
        &[&commands[..], &kills, &["--json", "kills.json"]].concat(),
    );
    run.succeeds();
    let train = ["kills", "--command", "train", "--template", &template];
    let few = ["--kills", "1", "--at-the-end", "1", "--json", "train.json"];
    deepsft_lab(folder.path(), &[&train[..], &few].concat()).succeeds();
    for (file, reports) in [("kills.json", 3), ("train.json", 1)] {
        let reported = json(&folder.path().join(file));
        assert_eq!(reported.as_array().unwrap().len(), reports);
        for report in reported.as_array().unwrap() {
            for kind in ["anywhere", "at_the_end"] {
                assert_eq!(report[kind]["kills"], 1, "{report}");
            }
            assert!(report["equal"].as_u64().unwrap() > 0, "{report}");
        }
    }
}
