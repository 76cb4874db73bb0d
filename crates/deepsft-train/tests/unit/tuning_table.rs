//! The table of a tuning.

use deepsft_train::{MeanMedian, RecordingMetrics, tuning_table};

#[test]
fn the_table_leaves_out_what_a_recording_without_truth_does_not_know() {
    let row = |mean: f64| RecordingMetrics {
        measured_depth_rmse_mm: Some(MeanMedian {
            mean,
            median: 2.0,
            frames: 2,
        }),
        measured_depth_pixels: 4321,
        photo_consistency_error: Some(MeanMedian {
            mean: 0.125,
            median: 0.1,
            frames: 1,
        }),
        ..RecordingMetrics::default()
    };
    let table = tuning_table(
        "recording",
        8,
        2,
        &[("before".to_owned(), row(12.5)), ("after step 2".to_owned(), row(9.0))],
    );
    let lines: Vec<&str> = table.lines().collect();
    assert_eq!(lines[0], "Held-out end of the recording: 2 of 8 frames, mean / median");
    assert_eq!(
        lines[2],
        "| | depth RMSE to the sensor, mm (2 frames) | E_pr (1 frames) |"
    );
    assert!(table.ends_with("to the sensor is over 4321 pixels of these frames, the same in every row\n"));
    assert_eq!(lines[4], "| before | 12.50 / 2.00 | 0.1250 / 0.1000 |");
    assert!(lines[5].starts_with("| after step 2 | 9.00"));
}
