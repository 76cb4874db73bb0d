//! What a checkpoint holds, and what there is of one.

use deepsft_train::{Checkpoint, CurvePoint, existing_checkpoints};

#[test]
fn a_loss_that_was_not_measured_is_null_in_a_checkpoint_and_those_of_older_ones_are_numbers() {
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

#[test]
fn what_a_kill_leaves_of_a_checkpoint_is_found() {
    let above = tempfile::tempdir().unwrap();
    let folder = above.path().join("model.checkpoint");
    let old = above.path().join("model.checkpoint.old");
    assert!(existing_checkpoints(&folder).is_empty());
    std::fs::create_dir(&old).unwrap();
    assert_eq!(existing_checkpoints(&folder), std::slice::from_ref(&old));
    std::fs::create_dir(&folder).unwrap();
    assert_eq!(existing_checkpoints(&folder), [folder, old]);
}
