//! `deepsft reconstruct --flat` and `--maps image`: the photographed print, laid flat, and the maps of its pixels.

use crate::common::{deepsft, npy};
use deepsft::decode_picture;
use deepsft_geometry::Picture;
use std::fs;
use std::path::Path;

const USAGE: i32 = 2;

fn picture(path: &Path) -> Picture {
    decode_picture(&fs::read(path).unwrap()).unwrap()
}

/// Correlation of a flat print with the picture, and the pixels that are compared: those of some confidence.
fn likeness(flat: &Picture, confidence: &Picture, path: &Path) -> (f64, f64) {
    let texture = picture(path);
    let (width, height) = (flat.width(), flat.height());
    let scale = texture.width() as f64 / width as f64;
    let (mut sums, mut count) = ([0.0; 5], 0.0);
    for place in 0..width * height {
        let (x, y) = (place % width, place / width);
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
    ((ab - a * b) / ((aa - a * a) * (bb - b * b)).sqrt(), count)
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
    let flat_width = ["--flat", "300"];
    deepsft(folder.path(), &[&arguments[..], &printed, &flat_width].concat()).succeeds();
    let results = folder.path().join("results/frame-00000");
    let [flat, confidence] = ["flat.png", "flat-confidence.png"].map(|name| picture(&results.join(name)));
    assert_eq!((flat.size(), flat.size()), ((300, 212).into(), confidence.size()));
    let (correlation, count) = likeness(&flat, &confidence, Path::new(&path));
    // The texture's pixels are compared one by one, and the photograph is coarser.
    assert!(
        correlation > 0.7 && count > 0.7 * 300.0 * 212.0,
        "{correlation}, {count}"
    );

    let mean_difference = |flat: &Picture| {
        let texture = picture(Path::new(&path));
        let scale = texture.width() as f64 / flat.width() as f64;
        let seen = (0..300 * 212).map(|place| (place % 300, place / 300));
        let seen = seen.filter(|(x, y)| confidence.pixel(*x, *y)[0] > 0);
        let off = seen.map(|(x, y)| {
            let drawn = texture.sample((x as f64 + 0.5) * scale, (y as f64 + 0.5) * scale);
            let pixel = flat.pixel(x, y);
            (0..3).map(|k| (f32::from(pixel[k]) - drawn[k]).abs()).sum::<f32>()
        });
        off.sum::<f32>() / (3.0 * count as f32)
    };
    deepsft(
        folder.path(),
        &[&arguments[..], &printed, &flat_width, &["--unshaded"]].concat(),
    )
    .succeeds();
    let unshaded = mean_difference(&picture(&results.join("flat.png")));
    let shaded = mean_difference(&flat);
    assert!(unshaded < 0.8 * shaded, "{shaded} -> {unshaded} of 255");
    deepsft(folder.path(), &[&arguments[..], &printed, &["--unshaded"]].concat()).fails(USAGE, &["--flat"]);

    let of_maps = ["--mesh", "none", "--flat", "300"];
    let model = ["--model", shipped];
    deepsft(folder.path(), &[&arguments[..], &model, &of_maps].concat()).fails(USAGE, &["--flat", "--mesh none"]);
    let of_image = ["--maps", "image"];
    deepsft(
        folder.path(),
        &[&arguments[..], &model, &of_image, &of_maps[..2]].concat(),
    )
    .fails(USAGE, &["--maps", "--mesh none"]);
    // Without it, what an earlier run has laid flat goes.
    deepsft(folder.path(), &[&arguments[..], &printed].concat()).succeeds();
    assert!(!results.join("flat.png").exists());

    // The photograph's own pixels are half as large as the canonical ones: four around each corner of theirs.
    let depths = |columns: &str| -> Vec<f32> {
        let (header, bytes) = npy(&results.join("depth.npy"));
        assert!(header.contains(columns), "{header}");
        bytes
            .as_chunks()
            .0
            .iter()
            .map(|depth| f32::from_le_bytes(*depth))
            .collect()
    };
    let canonical = depths("(270, 480)");
    deepsft(folder.path(), &[&arguments[..], &printed, &of_image].concat()).succeeds();
    let fine = depths("(540, 960)");
    let mut compared = 0;
    for (pixel, depth) in canonical.iter().enumerate().filter(|(_, depth)| **depth > 0.0) {
        let first = 2 * (pixel / 480) * 960 + 2 * (pixel % 480);
        let four = [0, 1, 960, 961].map(|step| fine[first + step]);
        if four.iter().all(|depth| *depth > 0.0) {
            let mean = four.iter().sum::<f32>() / 4.0;
            assert!((mean - depth).abs() < 0.5, "{mean} and {depth}");
            compared += 1;
        }
    }
    assert!(compared > 10_000, "{compared}");
}

#[test]
fn the_print_of_a_video_is_laid_flat_without_the_arm_that_passes_before_it() {
    let folder = tempfile::tempdir().unwrap();
    let path = concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/../../models/poster-a4/template/texture.png"
    );
    let printed = ["--picture", path, "--size-mm", "297x210"];
    let event = "clip --frames 30 --event occlusion --seed 9000000 --scale 2 --out clip";
    deepsft(
        folder.path(),
        &[&event.split(' ').collect::<Vec<_>>()[..], &printed].concat(),
    )
    .succeeds();
    let laid_flat = |more: &[&str]| {
        let arguments = ["track", "--find-every", "5", "--out", "track"];
        deepsft(folder.path(), &[&arguments[..], &printed, more].concat())
    };
    laid_flat(&["--flat", "200", "clip"]).succeeds();
    let track = folder.path().join("track");
    let of = |folder: &Path| ["flat.png", "flat-confidence.png"].map(|name| picture(&folder.join(name)));
    let [flat, confidence] = of(&track);
    let (all, count) = likeness(&flat, &confidence, Path::new(path));
    assert_eq!((flat.size(), confidence.size()), ((200, 141).into(), (200, 141).into()));
    // One frame with the arm before it.
    let camera = [
        "reconstruct",
        "--camera",
        "clip/camera.json",
        "--flat",
        "200",
        "--out",
        "results",
        "clip/frame-00015.png",
    ];
    deepsft(folder.path(), &[&camera[..], &printed].concat()).succeeds();
    let [one, _] = of(&folder.path().join("results/frame-00015"));
    let (one, _) = likeness(&one, &confidence, Path::new(path));
    println!("{all} of {count}, one frame {one}");
    assert!(
        all > 0.7 && all > one + 0.1 && count > 0.95 * 200.0 * 141.0,
        "{all} of {count}, one frame {one}"
    );
    // It is no longer there after a track without it, and a smoothed mesh trails behind the image.
    laid_flat(&["clip"]).succeeds();
    assert!(!track.join("flat.png").exists());
    laid_flat(&["--flat", "200", "--smooth", "clip"]).fails(USAGE, &["--smooth"]);
}
