//! The table of evaluations, and the same as JSON.

use deepsft::{Judgement, Stage};
use deepsft_geometry::metrics::FrameMetrics;
use deepsft_train::{Evaluation, EvaluationReport, FrameResult, accuracy_table, reports_to_json};

fn row(model: &str, set: &str, stage: Option<Stage>, depths: &[f64]) -> EvaluationReport {
    let frame = |(index, &depth): (usize, &f64)| FrameResult {
        index: index as u64,
        has_template: true,
        judgement: Judgement {
            found: true,
            ..Judgement::default()
        },
        metrics: FrameMetrics {
            depth_rmse_mm: Some(depth),
            coverage: Some(0.75),
            ..FrameMetrics::default()
        },
        photo_consistency_error: Some(0.125),
        seconds: Some(0.25),
        ..FrameResult::default()
    };
    let evaluation = Evaluation {
        frames: depths.iter().enumerate().map(frame).collect(),
    };
    EvaluationReport::new(model, stage, set, &evaluation, "cpu")
}

#[test]
fn each_model_and_set_has_a_line_of_means_and_one_of_medians() {
    let rows = [
        row("poster", "set a", None, &[1.0, 2.0, 6.0]),
        row("cup", "a longer name", Some(Stage::Main), &[]),
    ];
    let text = accuracy_table(&rows);
    let words = |line: usize| -> Vec<&str> { text.lines().nth(line).unwrap().split_whitespace().collect() };
    let header = "model data set depth registr. registr. E_pr IoU coverage 3D frames/s";
    assert_eq!(words(0).join(" "), header);
    assert_eq!(words(1), ["mm", "px", "mm", "mm"]);
    assert_eq!(words(2).join(" "), "poster set a mean 3.00 - - 0.1250 - 0.7500 - 4.00");
    assert_eq!(words(3).join(" "), "median 2.00 - - 0.1250 - 0.7500 - 4.00");
    assert_eq!(
        words(4).join(" "),
        "cup, main block only a longer name mean - - - - - - - -"
    );
    // The figures stand below each other: lines that are as long end at the same column.
    let ends: Vec<usize> = [0, 2, 3].map(|line| text.lines().nth(line).unwrap().len()).to_vec();
    assert_eq!(ends, [ends[0]; 3]);
    assert!(text.contains("poster on set a: 3 of 3 frames show the object; it is found in 100.0 % of them"));
}

#[test]
fn a_single_row_is_the_whole_json_and_several_are_a_list() {
    let rows = [row("a", "x", None, &[1.0]), row("b", "x", Some(Stage::Main), &[2.0])];
    let json = |rows: &[EvaluationReport]| -> serde_json::Value {
        serde_json::from_slice(&reports_to_json(rows).unwrap()).unwrap()
    };
    let one = json(&rows[..1]);
    assert_eq!((&one["model"], &one["depth_rmse_mm"]), (&"a".into(), &1.0.into()));
    assert!(one.get("stage").is_none() && one.get("rows").is_none());
    let both = json(&rows);
    assert_eq!(both["rows"][1]["stage"], "main block only");
    assert_eq!(both["rows"][1]["median"]["frames_per_second"], 4.0);
    assert_eq!(both["rows"].as_array().unwrap().len(), 2);
}
