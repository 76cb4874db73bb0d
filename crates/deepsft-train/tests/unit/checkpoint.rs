//! What a checkpoint holds.

use deepsft_train::{Checkpoint, CurvePoint};

#[test]
fn a_loss_that_was_not_measured_is_null_in_a_checkpoint() {
    let point = |loss| CurvePoint {
        samples: 6,
        loss,
        depth_rmse_mm: Some(12.5),
        ..CurvePoint::default()
    };
    let state = Checkpoint {
        curve: vec![point(f64::NAN), point(0.25)],
        ..Checkpoint::default()
    };
    let text = serde_json::to_string(&state).unwrap();
    assert!(
        text.contains("\"loss\":null") && text.contains("\"loss\":0.25"),
        "{text}"
    );
    let read: Checkpoint = serde_json::from_str(&text).unwrap();
    assert!(read.curve[0].loss.is_nan());
    assert_eq!(read.curve[1], state.curve[1]);
}
