//! What the summary of an evaluation counts.

use deepsft_geometry::metrics::FrameMetrics;
use deepsft_train::{Evaluation, FitSummary, FrameResult};

/// A frame in which the network was off by 2 px and 20 mm.
fn frame(has_template: bool, has_mesh: bool, px: f64, mm: f64) -> FrameResult {
    let metrics = |px, mm| FrameMetrics {
        registration_rmse_px: Some(px),
        points_rmse_mm: Some(mm),
        ..FrameMetrics::default()
    };
    FrameResult {
        has_template,
        metrics: metrics(px, mm),
        network: has_mesh.then(|| metrics(2.0, 20.0)),
        ..FrameResult::default()
    }
}

#[test]
fn frames_per_second_are_one_over_the_mean_and_the_median_of_the_seconds() {
    let timed = |seconds| FrameResult {
        seconds: Some(seconds),
        ..frame(true, false, 1.0, 1.0)
    };
    let evaluation = Evaluation {
        frames: vec![timed(0.25), timed(0.5), timed(2.25), frame(false, false, 1.0, 1.0)],
    };
    let summary = evaluation.summary();
    assert_eq!(summary.mean.frames_per_second, Some(1.0));
    assert_eq!(summary.median.frames_per_second, Some(2.0));
}

#[test]
fn the_summary_tells_where_the_fit_is_worse_than_the_network() {
    let mut evaluation = Evaluation {
        frames: vec![
            frame(true, true, 0.5, 3.0),
            frame(true, true, 3.0, 15.0),
            frame(true, true, 0.4, 25.0),
            frame(true, true, 2.0, 20.0),
            frame(true, false, 9.0, 90.0),
            frame(false, true, 9.0, 90.0),
        ],
    };
    let expected = FitSummary {
        frames: 4,
        worse_registration_fraction: 0.25,
        worse_3d_fraction: 0.25,
    };
    assert_eq!(evaluation.summary().fit, Some(expected));
    assert_eq!(
        evaluation.summary().mean.rmse_3d_mm,
        Some((3.0 + 15.0 + 25.0 + 20.0 + 90.0) / 5.0)
    );
    evaluation.frames.retain(|frame| frame.network.is_none());
    assert_eq!(evaluation.summary().fit, None);
}
