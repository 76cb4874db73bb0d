//! Boards that others print: other markers, the older pattern, white on black.

#![allow(clippy::unwrap_used, clippy::panic)]

use deepsft_calibration::{Board, CalibrationError, CornerDetector};
use deepsft_geometry::Picture;
use deepsft_geometry::glam::DVec2;

const PIXELS_PER_MM: f64 = 3.0;
const MARGIN_PX: f64 = 40.0;

/// The board as a camera sees it from the front.
fn drawn(board: &Board, is_negative: bool) -> Picture {
    let size = (board.size_mm() * PIXELS_PER_MM + 2.0 * MARGIN_PX).ceil();
    let patches = board.patches(DVec2::ZERO);
    let level = |x: usize, y: usize| {
        let at = (DVec2::new(x as f64 + 0.5, y as f64 + 0.5) - MARGIN_PX) / PIXELS_PER_MM;
        let covers = |corner: DVec2, side: f64| at.cmpge(corner).all() && at.cmplt(corner + side).all();
        let top = patches.iter().rev().find(|patch| covers(patch.top_left, patch.side));
        if top.is_some_and(|patch| patch.is_black) != is_negative {
            30
        } else {
            225
        }
    };
    let sharp = Picture::from_fn(size.x as usize, size.y as usize, |x, y| [level(x, y); 3]);
    // No camera is as sharp.
    Picture::from_fn(sharp.width(), sharp.height(), |x, y| {
        sharp.sample(x as f64, y as f64).map(|c| c as u8)
    })
}

#[test]
fn boards_with_other_markers_of_the_older_pattern_and_white_on_black_are_detected() {
    let plain = Board::new(9, 6, 30.0).unwrap();
    let of = |name: &str, fraction: f64| plain.with_markers(name, fraction).unwrap();
    let boards = [
        ("ours", plain, false),
        ("5x5", of("DICT_5X5_100", 0.8), false),
        ("6x6", of("6x6_250", 0.6), false),
        ("7x7", of("dict_7x7_50", 0.75), false),
        ("AprilTag", of("APRILTAG_36h11", 0.7), false),
        ("ArUco's first", of("ARUCO_ORIGINAL", 0.75), false),
        ("older", of("5X5_100", 0.75).with_legacy_pattern().unwrap(), false),
        (
            "older, odd",
            Board::new(8, 7, 30.0).unwrap().with_legacy_pattern().unwrap(),
            false,
        ),
        ("negative", plain, true),
        (
            "older negative",
            of("6X6_250", 0.7).with_legacy_pattern().unwrap(),
            true,
        ),
    ];
    for (name, board, is_negative) in boards {
        let picture = drawn(&board, is_negative);
        let found = CornerDetector::charuco(&board)
            .unwrap()
            .detect(&picture)
            .unwrap_or_default();
        let corners = ((board.size_mm() / 30.0).round() - 1.0).element_product() as usize;
        assert!(found.len() * 10 >= corners * 8, "{name}: {} of {corners}", found.len());
        // Where the board begins is nobody's concern.
        let begin = |k: usize| found[k].pixel - PIXELS_PER_MM * found[k].place_mm;
        for k in 0..found.len() {
            assert!(
                begin(k).distance(begin(0)) < 1.0,
                "{name}: {} and {}",
                begin(k),
                begin(0)
            );
        }
        if name != "ours" && name != "negative" && name != "older, odd" {
            let as_ours = CornerDetector::charuco(&plain).unwrap().detect(&picture);
            assert!(as_ours.is_none_or(|seen| seen.len() < found.len() / 2), "{name}");
        }
    }
    // The first square of the older pattern is white, with the first marker, and it has as many rows.
    let older = plain.with_legacy_pattern().unwrap();
    let first = older.patches(DVec2::ZERO)[0];
    let corner = first.top_left.distance(DVec2::splat(3.75));
    assert!(
        first.is_black && (first.side - 22.5).abs() < 1e-6 && corner < 1e-6,
        "{first:?}"
    );
    assert_eq!(older.size_mm(), plain.size_mm());
}

#[test]
fn what_is_no_dictionary_or_has_too_few_markers_is_refused() {
    let plain = Board::new(9, 6, 30.0).unwrap();
    for (refused, cause) in [
        (plain.with_markers("5X5_77", 0.75), "no dictionary 5X5_77"),
        (plain.with_markers("5X5_100", 1.5), "such board"),
        (
            Board::new(10, 9, 30.0).and_then(|board| board.with_markers("APRILTAG_16h5", 0.75)),
            "such board",
        ),
        (
            Board::new(10, 10, 30.0).and_then(Board::with_legacy_pattern),
            "50 markers",
        ),
    ] {
        let error = refused.unwrap_err();
        assert!(
            matches!(error, CalibrationError::Board(_)) && error.to_string().contains(cause),
            "{error}"
        );
    }
}
