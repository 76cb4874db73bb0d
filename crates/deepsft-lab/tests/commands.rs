//! Every command of the lab on small input, run as users run it.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use serde_json::Value;
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

/// A GoPro's image is 59 degrees across and the training camera's 65: taken for that one's, depths would be off by a sixth (70 mm).
#[test]
fn one_scene_is_measured_through_all_cameras() {
    let folder = tempfile::tempdir().unwrap();
    let model = shipped_model();
    let study = [
        "study",
        "cameras",
        "--model",
        &model,
        "--scenes",
        "1",
        "--near-scenes",
        "0",
    ];
    let run = deepsft_lab(folder.path(), &[&study[..], &["--json", "cameras.json"]].concat());
    assert!(run.succeeds().stdout.contains("wide-phone, upright"), "{}", run.stdout);
    let report = json(&folder.path().join("cameras.json"));
    let rows = report["cameras"].as_array().unwrap();
    assert_eq!((rows.len(), report["near"].as_array().unwrap().len()), (10, 6));
    for row in rows
        .iter()
        .filter(|row| row["camera"].as_str().unwrap().ends_with("across"))
    {
        assert_eq!(row["found"], 1, "{row}");
        assert!(row["fitted"]["depth_mm"][1].as_f64().unwrap() < 20.0, "{row}");
    }
}

#[test]
fn the_study_of_a_few_clips_has_its_figures() {
    let folder = tempfile::tempdir().unwrap();
    let model = shipped_model();
    let study = [
        "study", "tracking", "--model", &model, "--clips", "1", "--frames", "30", "--event", "still",
    ];
    let files = ["--json", "figures.json"];
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
    deepsft_lab(folder.path(), &[&study[..8], &["--event", "earthquake"]].concat()).fails(2, &["jump-cut"]);
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
    let kinds = ["photograph-like", "graphic", "text, line art", "repetitive"];
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
