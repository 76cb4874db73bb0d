//! `deepsft reconstruct --flat`: the photographed print, laid flat.

use crate::common::deepsft;
use deepsft::decode_picture;
use deepsft_geometry::Picture;
use std::fs;
use std::path::Path;

const USAGE: i32 = 2;

fn picture(path: &Path) -> Picture {
    decode_picture(&fs::read(path).unwrap()).unwrap()
}

#[test]
fn a_photographed_print_is_laid_flat() {
    let folder = tempfile::tempdir().unwrap();
    let shipped = concat!(env!("CARGO_MANIFEST_DIR"), "/../../models/poster-a4");
    let path = format!("{shipped}/template/texture.png");
    let printed = ["--picture", &path, "--size-mm", "297x210"];
    let clip = ["clip", "--frames", "1", "--scale", "2", "--seed", "5", "--out", "clip"];
    deepsft(folder.path(), &[&clip[..], &printed].concat()).succeeds();
    let arguments = [
        "reconstruct",
        "--camera",
        "clip/camera.json",
        "--out",
        "results",
        "clip/frame-00000.png",
    ];
    let flat = ["--flat", "300"];
    deepsft(folder.path(), &[&arguments[..], &printed, &flat].concat()).succeeds();
    let results = folder.path().join("results/frame-00000");
    let [flat, confidence] = ["flat.png", "flat-confidence.png"].map(|name| picture(&results.join(name)));
    assert_eq!((flat.size(), flat.size()), ((300, 212).into(), confidence.size()));
    let texture = picture(Path::new(&path));
    let scale = texture.width() as f64 / 300.0;
    let (mut sums, mut count) = ([0.0; 5], 0.0);
    for place in 0..300 * 212 {
        let (x, y) = (place % 300, place / 300);
        if confidence.pixel(x, y)[0] > 0 {
            let drawn = texture.sample((x as f64 + 0.5) * scale, (y as f64 + 0.5) * scale)[1];
            let (a, b) = (f64::from(flat.pixel(x, y)[1]), f64::from(drawn));
            for (sum, value) in sums.iter_mut().zip([a, b, a * a, b * b, a * b]) {
                *sum += value;
            }
            count += 1.0;
        }
    }
    let [a, b, aa, bb, ab] = sums.map(|sum| sum / count);
    let correlation = (ab - a * b) / ((aa - a * a) * (bb - b * b)).sqrt();
    // The texture's pixels are compared one by one, and the photograph is coarser.
    assert!(
        correlation > 0.7 && count > 0.7 * 300.0 * 212.0,
        "{correlation}, {count}"
    );

    let of_maps = ["--mesh", "none", "--flat", "300"];
    let model = ["--model", shipped];
    deepsft(folder.path(), &[&arguments[..], &model, &of_maps].concat()).fails(USAGE, &["--flat", "--mesh none"]);
    // Without it, what an earlier run has laid flat goes.
    deepsft(folder.path(), &[&arguments[..], &printed].concat()).succeeds();
    assert!(!results.join("flat.png").exists());
}
