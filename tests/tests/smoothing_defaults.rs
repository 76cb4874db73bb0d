//! The smoothing that the browser's package documents is the one that the tracker does.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use deepsft_geometry::tracking::OneEuroOptions;

/// The number that stands behind `before` in `text`.
fn number_after(text: &str, before: &str) -> f64 {
    let (_, rest) = text.split_once(before).expect(before);
    let end = rest.find(|c: char| !(c.is_ascii_digit() || c == '.')).unwrap();
    rest[..end].parse().expect(rest)
}

#[test]
fn javascript_and_rust_have_the_same_defaults_of_the_one_euro_filter() {
    let www = concat!(env!("CARGO_MANIFEST_DIR"), "/../www/src");
    let read = |file: &str| std::fs::read_to_string(format!("{www}/{file}")).expect(file);
    let documented = read("tracking/tracker-host.js");
    let defaults = OneEuroOptions::default();
    assert_eq!(
        number_after(&documented, "`minCutoff` (Hz, default "),
        defaults.min_cutoff_hz
    );
    assert_eq!(
        number_after(&documented, "`beta` (Hz per mm/s, default "),
        defaults.speed_coefficient
    );
    // JavaScript passes on what it is given and has no defaults of its own.
    let settings = read("deepsft.js").replace(' ', "");
    for name in ["minCutoff", "beta"] {
        assert!(
            !settings.contains(&format!("{name}=")),
            "{name} has a default in JavaScript"
        );
    }
}
