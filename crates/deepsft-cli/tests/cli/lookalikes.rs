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

#[test]
fn copies_of_a_print_are_followed_where_they_are_asked_for() {
    let folder = tempfile::tempdir().unwrap();
    let shown = concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/../../models/poster-a4/template/texture.png"
    );
    let picture = decode_picture(&fs::read(shown).unwrap()).unwrap();
    let scale = picture.width() as f64 / 400.0;
    // Two prints side by side, seen from the front.
    let frame = Picture::from_fn(960, 540, |x, y| match (x % 480, y) {
        (40..440, 130..412) => {
            let at = [(x % 480 - 40) as f64, (y - 130) as f64].map(|along| (along + 0.5) * scale);
            picture.sample(at[0], at[1]).map(|level| level as u8)
        }
        _ => [(60 + (x / 40 + y / 40) % 2 * 25) as u8; 3],
    });
    fs::create_dir(folder.path().join("video")).unwrap();
    for name in ["1.png", "2.png", "3.png"] {
        fs::write(folder.path().join("video").join(name), encode_png(&frame).unwrap()).unwrap();
    }
    let track = |copies: &[&str]| {
        let arguments = [
            "track",
            "--picture",
            shown,
            "--size-mm",
            "297x210",
            "--find-every",
            "1",
            "--out",
            "track",
            "video",
        ];
        deepsft(folder.path(), &[&arguments[..], copies].concat()).succeeds();
        let report: Value = serde_json::from_slice(&fs::read(folder.path().join("track/track.json")).unwrap()).unwrap();
        let header = fs::read(folder.path().join("track/vertices.npy")).unwrap();
        let shape = String::from_utf8_lossy(&header[..128])
            .split_once("'shape': (")
            .map(|(_, shape)| shape.to_owned());
        let middles = header.len();
        (report, shape.unwrap(), middles)
    };
    let (report, shape, bytes) = track(&[]);
    assert!(
        report["per_frame"][2]["copies"].is_null() && shape.starts_with("3, "),
        "{shape}"
    );
    let (report, shape, more) = track(&["--copies", "3"]);
    assert!(
        shape.starts_with("3, 3, ") && more - 128 == 3 * (bytes - 128),
        "{shape}"
    );
    let last = &report["per_frame"][2];
    assert_eq!(
        (&last["found"], &last["copies"][0]["found"], &last["copies"][1]["found"]),
        (&true.into(), &true.into(), &false.into())
    );
}
