//! The commands on good input: what they write, and that each reads what the one before it wrote.

use crate::common::{art, deepsft, deepsft_without_reader, npy, write_bundle, write_photograph, write_template};
use deepsft::encode_png;
use deepsft_geometry::Picture;
use serde_json::Value;
use std::fs;
use std::path::Path;

fn json(path: &Path) -> Value {
    serde_json::from_slice(&fs::read(path).unwrap()).unwrap()
}

#[test]
fn help_teaches_by_example_and_names_the_exit_codes() {
    let folder = tempfile::tempdir().unwrap();
    let help = deepsft(folder.path(), &["--help"]);
    assert!(help.succeeds().stdout.contains("Exit codes") && help.stdout.contains("template new --image"));
    for command in [
        ["template", "new"].as_slice(),
        &["synth"],
        &["train"],
        &["eval"],
        &["reconstruct"],
        &["track"],
        &["clip"],
    ] {
        let help = deepsft(folder.path(), &[command, &["--help"]].concat());
        assert!(help.succeeds().stdout.contains("DIR"), "{command:?}: {}", help.stdout);
    }
}

#[test]
fn a_command_whose_reader_went_away_ends_quietly() {
    let folder = tempfile::tempdir().unwrap();
    write_bundle(folder.path(), "model");
    // One that prints a table, one that prints lines.
    for command in [["network", "describe", "compact"], ["bundle", "verify", "model"]] {
        let run = deepsft_without_reader(folder.path(), &command);
        assert_eq!((run.code, run.stderr.as_str()), (141, ""), "{command:?}");
    }
}

#[test]
fn a_template_is_written_and_an_older_one_replaced() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("art.png"), encode_png(&art()).unwrap()).unwrap();
    for size in ["400x300", "40.5x30.5"] {
        let new = [
            "template",
            "new",
            "--image",
            "art.png",
            "--size-mm",
            size,
            "--out",
            "deep/template",
        ];
        deepsft(folder.path(), &new).succeeds();
    }
    let template = folder.path().join("deep/template");
    // A picture that somebody keeps in the folder makes the template, and is still there after it.
    fs::rename(folder.path().join("art.png"), template.join("art.png")).unwrap();
    let inside = "template new --image deep/template/art.png --size-mm 40.5x30.5 --out deep/template";
    deepsft(folder.path(), &inside.split(' ').collect::<Vec<_>>()).succeeds();
    fs::rename(template.join("art.png"), folder.path().join("art.png")).unwrap();
    let description = json(&template.join("template.json"));
    assert_eq!(
        (description["width_mm"].as_f64(), description["height_mm"].as_f64()),
        (Some(40.5), Some(30.5))
    );
    assert_eq!(
        (description["format_version"].as_u64(), description["kind"].as_str()),
        (Some(1), Some("thin-shell"))
    );
    let texture = fs::read(template.join(description["texture"].as_str().unwrap())).unwrap();
    assert_eq!(deepsft::decode_picture(&texture).unwrap(), art());
    let stretched = [
        "template",
        "new",
        "--image",
        "art.png",
        "--size-mm",
        "30x40",
        "--out",
        "turned",
    ];
    assert!(
        deepsft(folder.path(), &stretched)
            .succeeds()
            .stderr
            .contains("exchanged")
    );
}

#[test]
fn a_picture_that_will_be_found_badly_is_warned_of() {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, picture: &Picture| {
        fs::write(folder.path().join(name), encode_png(picture).unwrap()).unwrap();
    };
    // Blocks of any grey, and the same on the left half alone.
    let rich = |x: usize, y: usize| [(mixed(31 * (x / 12) + y / 12) % 256) as u8; 3];
    write("rich.png", &Picture::from_fn(600, 420, rich));
    write(
        "half.png",
        &Picture::from_fn(600, 420, |x, y| if x < 300 { rich(x, y) } else { [230; 3] }),
    );
    write("photo.png", &Picture::from_fn(640, 360, |_, _| [90; 3]));
    for (picture, warning) in [("half.png", true), ("rich.png", false)] {
        for command in [
            "template new --image PICTURE --size-mm 297x208 --out template",
            "reconstruct --picture PICTURE --size-mm 297 --out results photo.png",
            "clip --picture PICTURE --size-mm 297 --frames 1 --out clip",
            "track --picture PICTURE --size-mm 297 --out track clip",
        ] {
            let words: Vec<&str> = command
                .split(' ')
                .map(|word| if word == "PICTURE" { picture } else { word })
                .collect();
            let stderr = deepsft(folder.path(), &words).succeeds().stderr.clone();
            let told = stderr.contains("warning: The picture is mostly one colour on the right");
            assert_eq!(told, warning, "{picture} {command}: {stderr}");
        }
    }
}

/// A number without pattern.
fn mixed(number: usize) -> usize {
    let mixed = (number as u64 + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    ((mixed ^ (mixed >> 29)).wrapping_mul(0xbf58_476d_1ce4_e5b9) >> 33) as usize
}

#[test]
fn a_data_set_is_the_same_however_it_is_cut_and_can_be_evaluated_on() {
    let folder = tempfile::tempdir().unwrap();
    write_template(folder.path(), "template");
    write_bundle(folder.path(), "model");
    let synth = |first: &str, count: &str, out: &str| {
        let arguments = [
            "synth",
            "--template",
            "template",
            "--seed",
            "4",
            "--first",
            first,
            "--count",
            count,
        ];
        deepsft(
            folder.path(),
            &[&arguments[..], &["--shard-size", "2", "--out", out]].concat(),
        )
        .succeeds();
    };
    synth("0", "4", "whole");
    synth("2", "2", "part");
    let shard = |name: &str| fs::read(folder.path().join(name)).unwrap();
    assert!(shard("whole/shard-000001.tar") == shard("part/shard-000000.tar"));

    let eval = |set: &[&str]| {
        let arguments = ["eval", "--model", "model", "--json", "figures.json"];
        deepsft(folder.path(), &[&arguments[..], set].concat()).succeeds();
        json(&folder.path().join("figures.json"))
    };
    let figures = eval(&["--dataset", "whole"]);
    let keys = [
        "depth_rmse_mm",
        "registration_rmse_px",
        "registration_rmse_mm",
        "rmse_3d_mm",
        "mask_iou",
        "coverage",
    ];
    assert_eq!(figures["frames"].as_u64(), Some(4));
    assert_eq!(figures["per_frame"].as_array().unwrap().len(), 4);
    for key in keys {
        assert!(
            figures.get(key).is_some() && figures["median"].get(key).is_some(),
            "{key} is not in {figures}"
        );
    }
    // The same frames from memory; the files round depth to 0.05 mm and the mask not at all.
    let synthetic = eval(&["--synthetic", "4", "--seed", "4"]);
    assert_eq!(figures["mask_iou"], synthetic["mask_iou"]);
    assert!(figures["mask_iou"].is_number());
}

#[test]
fn a_reconstruction_is_maps_a_mesh_a_sheet_and_a_report() {
    let folder = tempfile::tempdir().unwrap();
    write_bundle(folder.path(), "model");
    write_photograph(folder.path(), "photo.one.png");
    let arguments = ["reconstruct", "--model", "model", "--out", "results", "photo.one.png"];
    let own_maps = ["--mesh", "none"];
    deepsft(folder.path(), &[&arguments[..], &own_maps].concat()).succeeds();
    // Again: the older results are replaced.
    deepsft(folder.path(), &[&arguments[..], &own_maps].concat()).succeeds();
    let results = folder.path().join("results/photo.one");
    for (name, shape, bytes) in [
        ("depth.npy", "(270, 480)", 4 * 270 * 480),
        ("registration.npy", "(270, 480, 2)", 8 * 270 * 480),
        ("mask.npy", "(270, 480)", 270 * 480),
    ] {
        let (header, values) = npy(&results.join(name));
        assert!(header.contains(shape), "{header}");
        assert_eq!(values.len(), bytes);
    }
    let depth = npy(&results.join("depth.npy")).1;
    let seen = depth
        .chunks_exact(4)
        .filter(|d| f32::from_le_bytes([d[0], d[1], d[2], d[3]]) > -1.0)
        .count();
    let mask = npy(&results.join("mask.npy")).1;
    assert_eq!(seen, mask.iter().filter(|&&inside| inside == 1).count());

    let report = json(&results.join("report.json"));
    assert!(report["found"].is_boolean() && report["confidence"].is_number());
    // 0.79 of the longer side, 640.
    assert_eq!(report["camera"]["source"].as_str(), Some("assumed"));
    assert!((report["camera"]["fx"].as_f64().unwrap() - 505.6).abs() < 1e-9);
    assert_eq!(report["canonical_camera"]["width"].as_u64(), Some(480));
    for stage in ["decode", "canonical_warp", "network", "confidence"] {
        assert!(report["stage_ms"][stage].as_f64().unwrap() >= 0.0, "{stage}");
    }
    let sheet = deepsft::decode_picture(&fs::read(results.join("sheet.png")).unwrap()).unwrap();
    assert!(sheet.width() > 2 * 480 && sheet.height() > 2 * 270);
    // Of an upright photograph everything stands upright.
    let upright = Picture::from_fn(360, 640, |x, y| [(x % 256) as u8, (y % 256) as u8, 90]);
    fs::write(folder.path().join("upright.png"), encode_png(&upright).unwrap()).unwrap();
    let of_upright = ["reconstruct", "--model", "model", "--out", "results", "upright.png"];
    deepsft(folder.path(), &[&of_upright[..], &own_maps].concat()).succeeds();
    let upright = folder.path().join("results/upright");
    assert!(npy(&upright.join("depth.npy")).0.contains("(480, 270)"));
    assert_eq!(
        json(&upright.join("report.json"))["canonical_camera"]["width"].as_u64(),
        Some(270)
    );
    assert_eq!(fs::read(results.join("mesh.glb")).unwrap()[..4], *b"glTF");
    assert!(report["mesh_taken"].is_null());

    // In an image of one grey there is nothing to fit a mesh to, whatever the weights of the network, and the report says so.
    let plain = Picture::from_fn(640, 360, |_, _| [128; 3]);
    fs::write(folder.path().join("photo.one.png"), encode_png(&plain).unwrap()).unwrap();
    for how in [&[][..], &["--mesh", "fit"], &["--mesh", "complete"]] {
        deepsft(folder.path(), &[&arguments[..], how].concat()).succeeds();
        let report = json(&results.join("report.json"));
        assert_eq!(report["mesh_taken"].as_bool(), Some(false), "{how:?}");
        assert!(!results.join("whole-mesh.glb").exists());
    }
}

#[test]
fn a_training_makes_a_bundle_and_goes_on_where_it_ended() {
    let folder = tempfile::tempdir().unwrap();
    write_template(folder.path(), "template");
    fs::create_dir(folder.path().join("model")).unwrap();
    let train = |samples: &str, extra: &[&str]| {
        let arguments = [
            "train",
            "--template",
            "template",
            "--out",
            "model",
            "--seed",
            "7",
            "--accuracy-frames",
            "8",
            "--samples",
            samples,
        ];
        deepsft(folder.path(), &[&arguments[..], extra].concat())
    };
    train("16", &[]).succeeds();
    deepsft(folder.path(), &["bundle", "verify", "model"]).succeeds();
    // A file that somebody lays beside it stays.
    fs::write(folder.path().join("model/poster.pdf"), "%PDF").unwrap();
    // The model is its maker's: no licence is stated unless they state one.
    assert_eq!(json(&folder.path().join("model/model.json")).get("licence"), None);
    assert!(
        train("32", &["--resume", "--licence", "CC-BY-4.0"])
            .succeeds()
            .stdout
            .contains("going on after 16 samples")
    );
    let model = json(&folder.path().join("model/model.json"));
    assert_eq!(model["provenance"]["samples"].as_u64(), Some(32));
    assert_eq!(model["provenance"]["seed"].as_u64(), Some(7));
    assert_eq!(model["accuracy"]["frames"].as_u64(), Some(8));
    assert_eq!(model["licence"].as_str(), Some("CC-BY-4.0"));
    assert_eq!(fs::read(folder.path().join("model/poster.pdf")).unwrap(), b"%PDF");
    assert!(
        fs::read_to_string(folder.path().join("model/CARD.md"))
            .unwrap()
            .contains("| training samples | 32 |")
    );
    let curve = fs::read_to_string(folder.path().join("model/curve.csv")).unwrap();
    let samples: Vec<&str> = curve
        .lines()
        .skip(1)
        .filter_map(|line| line.split(',').next())
        .collect();
    assert_eq!(samples, ["0", "16", "32"]);
    deepsft(folder.path(), &["bundle", "verify", "model"]).succeeds();
}

#[test]
fn a_network_is_described_by_name_or_from_a_bundle() {
    let folder = tempfile::tempdir().unwrap();
    let paper = deepsft(folder.path(), &["network", "describe", "paper"]);
    // The paper's printed count of a refinement block, and the main block's; operations worked out by hand.
    for part in [
        "13,618,689",
        "81,664,515",
        "83.1584",
        "135.2927",
        "108.9 MB in a bundle",
    ] {
        assert!(paper.succeeds().stdout.contains(part), "{part}: {}", paper.stdout);
    }
    write_bundle(folder.path(), "model");
    let described = deepsft(folder.path(), &["network", "describe", "model"]);
    assert!(
        described.succeeds().stdout.starts_with("compact"),
        "{}",
        described.stdout
    );
    let missing = deepsft(folder.path(), &["network", "describe", "vgg"]);
    missing.fails(3, &["vgg", "no such folder"]);
}
