//! `--lookalike`: prints of one series.

use crate::common::deepsft;
use deepsft::{decode_picture, encode_png};
use deepsft_geometry::Picture;
use serde_json::Value;
use std::fs;

const USAGE: i32 = 2;

#[test]
fn where_a_print_of_its_series_lies_a_picture_is_not_found() {
    let folder = tempfile::tempdir().unwrap();
    let shown = concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/../../models/poster-a4/template/texture.png"
    );
    let picture = decode_picture(&fs::read(shown).unwrap()).unwrap();
    let (width, height) = (picture.width(), picture.height());
    // The right half of it as in a mirror.
    let other = Picture::from_fn(width, height, |x, y| match x < width / 2 {
        true => picture.pixel(x, y),
        false => picture.pixel(width / 2 + width - 1 - x, y),
    });
    fs::write(folder.path().join("other.png"), encode_png(&other).unwrap()).unwrap();
    let clip = [
        "clip",
        "--picture",
        shown,
        "--size-mm",
        "297x210",
        "--frames",
        "1",
        "--scale",
        "2",
        "--seed",
        "5",
    ];
    deepsft(folder.path(), &[&clip[..], &["--out", "clip"]].concat()).succeeds();
    let looked_for = |picture: &str, lookalike: &[&str]| {
        let sized = [
            "--picture",
            picture,
            "--size-mm",
            "297x210",
            "--camera",
            "clip/camera.json",
        ];
        let arguments = [
            &["reconstruct"],
            &sized[..],
            lookalike,
            &["--out", "results", "clip/frame-00000.png"],
        ]
        .concat();
        let run = deepsft(folder.path(), &arguments);
        let report = fs::read(folder.path().join("results/frame-00000/report.json")).unwrap();
        let report: Value = serde_json::from_slice(&report).unwrap();
        (report["found"].as_bool().unwrap(), run.succeeds().stderr.clone())
    };
    assert!(looked_for("other.png", &[]).0, "half of it is there");
    let (is_found, notes) = looked_for("other.png", &["--lookalike", shown]);
    assert!(!is_found && notes.contains("texture.png shares "), "{notes}");
    assert!(looked_for(shown, &["--lookalike", "other.png"]).0);
    let alone = [
        "reconstruct",
        "--template",
        "cover",
        "--lookalike",
        shown,
        "--out",
        "results",
        "a.png",
    ];
    deepsft(folder.path(), &alone).fails(USAGE, &["--picture"]);
}
