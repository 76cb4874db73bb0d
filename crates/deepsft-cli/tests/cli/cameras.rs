//! `deepsft camera`: from a printed board, or a print, to the camera that photographs were taken by.

use crate::common::deepsft;
use deepsft::{decode_picture, encode_png};
use deepsft_geometry::glam::{DQuat, DVec2, DVec3};
use deepsft_geometry::{Camera, Picture};
use serde_json::Value;
use std::fs;
use std::path::Path;

/// Rotation vectors, and where the middle of the sheet is, mm.
const POSES: [([f64; 3], [f64; 3]); 8] = [
    ([0.45, -0.3, 0.1], [10.0, -15.0, 400.0]),
    ([-0.4, 0.4, -0.2], [-25.0, 15.0, 390.0]),
    ([0.1, 0.55, 0.25], [30.0, 10.0, 380.0]),
    ([-0.35, -0.5, 0.05], [-30.0, -15.0, 395.0]),
    ([0.55, 0.05, -0.3], [-10.0, 25.0, 375.0]),
    ([0.05, -0.35, 0.5], [20.0, 0.0, 410.0]),
    ([-0.55, 0.1, 0.0], [40.0, -25.0, 385.0]),
    ([0.3, 0.35, -0.1], [-45.0, 20.0, 400.0]),
];

fn camera() -> Camera {
    Camera::pinhole((960, 720), DVec2::new(820.0, 824.0), DVec2::new(487.0, 353.0))
        .unwrap()
        .with_distortion([-0.13, 0.05, 0.0, 0.0, 0.0])
        .unwrap()
}

/// A smaller picture: each pixel the mean of `by` x `by`.
fn shrunk(picture: &Picture, by: usize) -> Picture {
    Picture::from_fn(picture.width() / by, picture.height() / by, |x, y| {
        let mut sum = [0_u32; 3];
        for k in 0..by * by {
            let color = picture.pixel(x * by + k % by, y * by + k / by);
            for (s, c) in sum.iter_mut().zip(color) {
                *s += u32::from(c);
            }
        }
        sum.map(|s| (s / (by * by) as u32) as u8)
    })
}

/// A photograph of a sheet of `size_mm` that shows `print`, on grey, with noise; four samples a pixel.
fn photograph(camera: &Camera, print: &Picture, size_mm: DVec2, (turn, middle): ([f64; 3], [f64; 3])) -> Picture {
    let rotation = DQuat::from_scaled_axis(DVec3::from(turn));
    let normal = rotation * DVec3::Z;
    let texels = print.size().as_dvec2();
    let color = |pixel: DVec2| {
        let ray = camera.ray_from_pixel(pixel).extend(1.0);
        let p_camera = ray * (DVec3::from(middle).dot(normal) / ray.dot(normal));
        let place = (rotation.inverse() * (p_camera - DVec3::from(middle))).truncate() / size_mm + 0.5;
        let inside = place.cmpge(DVec2::ZERO).all() && place.cmple(DVec2::ONE).all();
        let texel = place * texels;
        if inside {
            print.sample(texel.x, texel.y)
        } else {
            [120.0; 3]
        }
    };
    let mut state = 1_u32;
    Picture::from_fn(camera.size().width, camera.size().height, |x, y| {
        let samples = [[0.25, 0.25], [0.75, 0.25], [0.25, 0.75], [0.75, 0.75]];
        let mut sum = [0.0_f32; 3];
        for [dx, dy] in samples {
            for (s, c) in sum.iter_mut().zip(color(DVec2::new(x as f64 + dx, y as f64 + dy))) {
                *s += c / 4.0;
            }
        }
        sum.map(|s| {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            let noise = (state >> 24) as f32 / 255.0 - 0.5;
            (0.8 * s + 25.0 + 10.0 * noise) as u8
        })
    })
}

fn photographs(folder: &Path, print: &Picture, size_mm: DVec2, poses: &[([f64; 3], [f64; 3])]) {
    fs::create_dir_all(folder).unwrap();
    for (index, &pose) in poses.iter().enumerate() {
        let photograph = photograph(&camera(), print, size_mm, pose);
        fs::write(folder.join(format!("{index}.png")), encode_png(&photograph).unwrap()).unwrap();
    }
}

/// Runs the calibration and compares with the camera; returns what it wrote.
fn calibrated(folder: &Path, arguments: &[&str], max_rms_px: f64) -> Value {
    let mut all = vec!["camera", "calibrate", "--out", "camera.json"];
    all.extend(arguments);
    deepsft(folder, &all).succeeds();
    let json: Value = serde_json::from_slice(&fs::read(folder.join("camera.json")).unwrap()).unwrap();
    let truth = camera();
    for (name, expected) in [
        ("fx", truth.focal().x),
        ("fy", truth.focal().y),
        ("cx", truth.principal_point().x),
        ("cy", truth.principal_point().y),
    ] {
        let actual = json[name].as_f64().unwrap();
        assert!(
            (actual / expected - 1.0).abs() < 0.005,
            "{name} {actual}, expected {expected}: {json}"
        );
    }
    let rms = json["calibration"]["rms_px"].as_f64().unwrap();
    assert!(rms < max_rms_px && rms > 0.0, "{rms}");
    assert_eq!(json["calibration"]["views"].as_array().unwrap().len(), POSES.len());
    let chart = decode_picture(&fs::read(folder.join("camera.png")).unwrap()).unwrap();
    assert!(
        chart.rgb().as_chunks::<3>().0.contains(&[24, 100, 171]),
        "there are no residuals in the picture"
    );
    json
}

#[test]
fn photographs_of_a_charuco_board_and_of_a_checkerboard_give_the_camera() {
    let folder = tempfile::tempdir().unwrap();
    deepsft(folder.path(), &["camera", "board", "--out", "board.png"]).succeeds();
    let board = decode_picture(&fs::read(folder.path().join("board.png")).unwrap()).unwrap();
    assert_eq!(board.size(), (3508, 2480).into());
    photographs(
        &folder.path().join("charuco"),
        &shrunk(&board, 3),
        DVec2::new(297.0, 210.0),
        &POSES,
    );
    let json = calibrated(folder.path(), &["--charuco", "9x6", "charuco"], 0.3);
    assert_eq!(json["calibration"]["model"], "radial");
    assert!(json["calibration"]["points"].as_u64().unwrap() > 250, "{json}");
    let checker = Picture::from_fn(1188, 840, |x, y| {
        let (column, row) = ((x as i64 - 54).div_euclid(120), (y as i64 - 60).div_euclid(120));
        let is_black = (0..9).contains(&column) && (0..6).contains(&row) && (column + row) % 2 == 0;
        [if is_black { 15 } else { 250 }; 3]
    });
    photographs(
        &folder.path().join("checker"),
        &checker,
        DVec2::new(297.0, 210.0),
        &POSES,
    );
    calibrated(folder.path(), &["--checkerboard", "checker"], 0.3);
    // Two photographs tell the focal length, with its deviation.
    let two = [
        "camera",
        "calibrate",
        "--charuco",
        "9x6",
        "--out",
        "two.json",
        "charuco/0.png",
        "charuco/1.png",
    ];
    let run = deepsft(folder.path(), &two);
    assert!(
        run.succeeds().stdout.contains("the focal length alone"),
        "{}",
        run.stdout
    );
    let two: Value = serde_json::from_slice(&fs::read(folder.path().join("two.json")).unwrap()).unwrap();
    let deviation = two["calibration"]["parameters"][0]["standard_deviation"]
        .as_f64()
        .unwrap();
    let focal = two["fx"].as_f64().unwrap();
    assert!(
        (focal / 822.0 - 1.0).abs() < 0.06 && deviation > 0.0,
        "{focal} ± {deviation}"
    );
    // A calibrated camera is a camera file.
    let camera = deepsft_formats::read_camera(&folder.path().join("camera.json")).unwrap();
    assert_eq!(camera.size(), (960, 720).into());
}

/// A JPEG file with an EXIF orientation.
fn oriented(picture: &Picture, orientation: u8) -> Vec<u8> {
    let jpeg = deepsft_formats::encode_jpeg(picture, 97).unwrap();
    let tiff = [
        b"Exif\0\0MM\0*\0\0\0\x08\0\x01\x01\x12\0\x03\0\0\0\x01\0".as_slice(),
        &[orientation, 0, 0, 0, 0, 0, 0],
    ]
    .concat();
    let length = (tiff.len() as u16 + 2).to_be_bytes();
    [&jpeg[..2], &[0xFF, 0xE1], &length, &tiff, &jpeg[2..]].concat()
}

#[test]
fn odd_photographs_among_those_of_a_board_are_named_and_left_out() {
    let folder = tempfile::tempdir().unwrap();
    deepsft(folder.path(), &["camera", "board", "--out", "board.png"]).succeeds();
    let board = decode_picture(&fs::read(folder.path().join("board.png")).unwrap()).unwrap();
    let mixed = folder.path().join("mixed");
    photographs(&mixed, &shrunk(&board, 3), DVec2::new(297.0, 210.0), &POSES);
    // Held the other way round, and upright: the sensor is where it was.
    for (name, orientation) in [(4, 3), (5, 3), (6, 6), (7, 8)] {
        let file = mixed.join(format!("{name}.png"));
        let picture = decode_picture(&fs::read(&file).unwrap()).unwrap();
        fs::remove_file(file).unwrap();
        fs::write(mixed.join(format!("{name}.jfif")), oriented(&picture, orientation)).unwrap();
    }
    let screenshot = encode_png(&Picture::from_fn(64, 48, |x, _| [x as u8; 3])).unwrap();
    fs::write(mixed.join("0-screenshot.png"), &screenshot).unwrap();
    fs::write(mixed.join("cut.png"), &screenshot[..60]).unwrap();
    fs::write(mixed.join("phone.HEIC"), b"ftypheic").unwrap();
    calibrated(folder.path(), &["--charuco", "9x6", "mixed"], 0.4);
    // A video that breaks off is used as far as it goes.
    let mut video = b"YUV4MPEG2 W960 H720 F25:1 Cmono XCOLORRANGE=FULL\n".to_vec();
    for pose in &POSES[..5] {
        let view = photograph(&camera(), &shrunk(&board, 3), DVec2::new(297.0, 210.0), *pose);
        let grey: Vec<u8> = view
            .rgb()
            .as_chunks::<3>()
            .0
            .iter()
            .map(|[_, green, _]| *green)
            .collect();
        (0..10).for_each(|_| video.extend([b"FRAME\n".as_slice(), &grey].concat()));
    }
    fs::write(folder.path().join("cut.y4m"), &video[..video.len() - 9]).unwrap();
    let arguments = ["camera", "calibrate", "--out", "c.json", "--charuco", "9x6", "cut.y4m"];
    let run = deepsft(folder.path(), &arguments);
    assert!(
        run.succeeds().stderr.contains("the first 49 frames are used"),
        "{}",
        run.stderr
    );
    let again = deepsft(
        folder.path(),
        &["camera", "calibrate", "--out", "b.json", "--charuco", "9x6", "mixed"],
    );
    let said = &again.succeeds().stderr;
    for words in ["cut.png", "phone.HEIC", "64 x 48"] {
        assert!(said.contains(words), "{words}: {said}");
    }
}

#[test]
fn a_camera_that_was_calibrated_across_is_turned_with_a_photograph_that_was_taken_upright() {
    let folder = tempfile::tempdir().unwrap();
    let texture = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../models/poster-a4/template/texture.png");
    let print = decode_picture(&fs::read(&texture).unwrap()).unwrap();
    let picture = photograph(&camera(), &print, DVec2::new(297.0, 210.0), POSES[2]);
    fs::write(folder.path().join("upright.jpg"), oriented(&picture, 6)).unwrap();
    fs::write(folder.path().join("across.jpg"), oriented(&picture, 1)).unwrap();
    // The same camera, as another program has it.
    let opencv = "%YAML:1.0\nimage_width: 960\nimage_height: 720\ncamera_matrix: !!opencv-matrix\n  rows: 3\n  cols: 3\n  dt: d\n  \
                  data: [820, 0, 486.5, 0, 824, 352.5, 0, 0, 1]\ndistortion_coefficients: [-0.13, 0.05, 0, 0]\n";
    fs::write(folder.path().join("opencv.yml"), opencv).unwrap();
    let import = ["camera", "import", "opencv.yml", "--out", "camera.json"];
    let imported = deepsft(folder.path(), &import);
    let said = &imported.succeeds().stdout;
    assert!(said.contains("960 x 720 pixels, focal length 820.00, 824.00"), "{said}");
    assert_eq!(
        deepsft_formats::read_camera(&folder.path().join("camera.json")).unwrap(),
        camera()
    );
    fs::write(folder.path().join("lens.yml"), opencv.replace("[-0.13", "[1, 2, -0.13")).unwrap();
    deepsft(folder.path(), &["camera", "import", "lens.yml", "--out", "b.json"])
        .fails(3, &["lens.yml", "4, 5, 8, 12 or 14"]);
    let texture = texture.to_str().unwrap();
    deepsft(
        folder.path(),
        &[
            ["reconstruct", "--picture", texture, "--size-mm", "297x210"].as_slice(),
            &[
                "--camera",
                "opencv.yml",
                "--out",
                "results",
                "upright.jpg",
                "across.jpg",
            ],
        ]
        .concat(),
    )
    .succeeds();
    let report = |name: &str| -> Value {
        serde_json::from_slice(&fs::read(folder.path().join("results").join(name).join("report.json")).unwrap())
            .unwrap()
    };
    let (upright, across) = (report("upright"), report("across"));
    assert_eq!((&upright["found"], &across["found"]), (&true.into(), &true.into()));
    assert_eq!(across["camera"]["source"], "file");
    assert_eq!(upright["camera"]["source"], "file, turned");
    let camera = &upright["camera"];
    let sides = [
        &camera["width"],
        &camera["height"],
        &camera["fx"],
        &camera["cx"],
        &camera["cy"],
    ];
    assert_eq!(
        sides.map(|value| value.as_f64().unwrap()),
        [720.0, 960.0, 824.0, 367.0, 487.0]
    );
    // The same sheet as far away.
    let depth = |report: &Value| report["depth_mm"][1].as_f64().unwrap_or_else(|| panic!("{report}"));
    assert!(
        (depth(&upright) - depth(&across)).abs() < 2.0,
        "{} {}",
        depth(&upright),
        depth(&across)
    );
}

#[test]
fn photographs_of_a_print_that_lies_flat_give_the_camera() {
    let folder = tempfile::tempdir().unwrap();
    let texture = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../models/poster-a4/template/texture.png");
    let print = decode_picture(&fs::read(&texture).unwrap()).unwrap();
    photographs(&folder.path().join("prints"), &print, DVec2::new(297.0, 210.0), &POSES);
    let texture = texture.to_str().unwrap();
    calibrated(
        folder.path(),
        &["--picture", texture, "--size-mm", "297x210", "prints"],
        0.3,
    );
}

#[test]
fn what_is_no_board_and_what_is_parallel_is_refused_with_what_to_do() {
    let folder = tempfile::tempdir().unwrap();
    deepsft(folder.path(), &["camera", "board", "--out", "board.png"]).succeeds();
    let board = decode_picture(&fs::read(folder.path().join("board.png")).unwrap()).unwrap();
    let parallel = [300.0, 340.0, 380.0, 420.0].map(|z| ([0.0; 3], [0.0, 0.0, z]));
    photographs(
        &folder.path().join("parallel"),
        &shrunk(&board, 3),
        DVec2::new(297.0, 210.0),
        &parallel,
    );
    let calibrate = |more: &[&str]| {
        let mut all = vec!["camera", "calibrate", "--charuco", "9x6", "--out", "camera.json"];
        all.extend(more);
        deepsft(folder.path(), &all)
    };
    calibrate(&["parallel"]).fails(3, &["parallel", "tilt the target"]);
    calibrate(&["parallel/0.png", "parallel/1.png"]).fails(3, &["2 of the 2 photographs", "at least 3"]);
    calibrate(&["--model", "radial", "parallel/0.png", "parallel/1.png"])
        .fails(3, &["2 of the 2 photographs", "at least 3"]);
    calibrate(&["--dictionary", "9x9", "parallel"]).fails(2, &["no dictionary 9x9", "5X5_100"]);
    let grey = encode_png(&Picture::from_fn(64, 48, |x, _| [x as u8; 3])).unwrap();
    fs::write(folder.path().join("grey.png"), grey).unwrap();
    calibrate(&["grey.png"]).fails(
        3,
        &[
            "grey.png",
            "no ChArUco board was seen",
            "--dictionary",
            "circles are not read",
        ],
    );
    calibrate(&["--dictionary", "5x5_50", "parallel"]).fails(3, &["no ChArUco board was seen in any of the 4"]);
    calibrate(&["parallel/0.png", "grey.png", "parallel/1.png"]).fails(3, &["grey.png", "2 of the 2 photographs"]);
    fs::write(folder.path().join("a.HEIC"), b"\0\0\0\x18ftypheic\0\0\0\0").unwrap();
    calibrate(&["a.HEIC"]).fails(3, &["a.HEIC", "export it as JPEG", "no photograph that can be used"]);
    calibrate(&["nowhere"]).fails(3, &["nowhere"]);
    // A video is read to its end, also between the frames that are looked at.
    let frame = [&b"FRAME\n"[..], &[128; 64 * 48]].concat();
    let video = [&b"YUV4MPEG2 W64 H48 F25:1 Cmono\n"[..], &frame.repeat(3)].concat();
    fs::write(folder.path().join("cut.y4m"), &video[..video.len() - 9]).unwrap();
    calibrate(&["cut.y4m"]).fails(3, &["video cut.y4m", "within a frame"]);
    assert!(!folder.path().join("camera.json").exists());
    deepsft(folder.path(), &["camera", "board", "--out", "board.svg"]).fails(2, &[".pdf or .png"]);
    deepsft(
        folder.path(),
        &["camera", "board", "--squares", "20x20", "--out", "b.pdf"],
    )
    .fails(2, &["no such board"]);
    deepsft(folder.path(), &["camera", "board", "--out", "board.pdf"]).succeeds();
    assert!(fs::read(folder.path().join("board.pdf")).unwrap().starts_with(b"%PDF"));
}
