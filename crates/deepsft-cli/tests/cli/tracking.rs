//! Clips and tracking.

use crate::common::{Run, deepsft, template, write_bundle, write_files, write_template};
use deepsft::encode_png;
use deepsft_geometry::Picture;
use serde_json::Value;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::thread::sleep;
use std::time::{Duration, Instant};

pub const FAILED: i32 = 1;
const USAGE: i32 = 2;
pub const INVALID_INPUT: i32 = 3;

/// How long a command may take to its first frames.
const PATIENCE: Duration = Duration::from_secs(120);

pub fn json(path: &Path) -> Value {
    serde_json::from_slice(&fs::read(path).unwrap()).unwrap()
}

/// The model that ships, a trained one.
fn shipped_model() -> String {
    let path = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../models/poster-a4");
    path.to_str().unwrap().to_owned()
}

fn clip(folder: &Path, extra: &[&str], out: &str) {
    deepsft(folder, &[&["clip"], extra, &["--out", out]].concat()).succeeds();
}

fn track(folder: &Path, model: &str, extra: &[&str]) -> Run {
    deepsft(
        folder,
        &[&["track", "--model", model, "--out", "track"], extra].concat(),
    )
}

/// Writes a grey frame of `width` x 36 pixels.
fn write_frame(folder: &Path, name: &str, width: usize) {
    fs::create_dir_all(folder).unwrap();
    let picture = Picture::from_fn(width, 36, |x, y| [((x * y) % 200) as u8; 3]);
    fs::write(folder.join(name), encode_png(&picture).unwrap()).unwrap();
}

/// Writes a `.y4m` stream of `frames` grey frames of 64 x 36 pixels: noise, in which no image confirms a print. (In stripes a
/// network without training found the template once in a while.)
pub fn write_stream(path: &Path, frames: usize) {
    let mut stream = b"YUV4MPEG2 W64 H36 F25:1 Cmono\n".to_vec();
    let mut noise = 1_u64;
    for _ in 0..frames {
        stream.extend(b"FRAME\n");
        stream.extend((0..64 * 36).map(|_| {
            noise = noise.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            (noise >> 56) as u8
        }));
    }
    fs::write(path, stream).unwrap();
}

#[test]
fn a_clip_is_frames_a_camera_and_its_truth_and_the_same_every_time() {
    let folder = tempfile::tempdir().unwrap();
    write_template(folder.path(), "template");
    write_bundle(folder.path(), "model");
    let options = ["--template", "template", "--frames", "5", "--event", "still"];
    clip(folder.path(), &options, "clip");
    clip(folder.path(), &options, "again");
    clip(folder.path(), &options, "again");
    clip(folder.path(), &[&options[..], &["--upright"]].concat(), "upright");
    let frame = deepsft::decode_picture(&fs::read(folder.path().join("upright/frame-00000.png")).unwrap()).unwrap();
    assert_eq!(frame.size(), (270, 480).into());
    track(folder.path(), "model", &["upright"]).succeeds();
    let report = json(&folder.path().join("track/track.json"));
    for camera in ["camera", "canonical_camera"] {
        assert_eq!(report[camera]["height"].as_u64(), Some(480), "{camera}");
    }
    let file = |clip: &str, name: &str| fs::read(folder.path().join(clip).join(name)).unwrap();
    for name in [
        "frame-00000.png",
        "frame-00004.png",
        "camera.json",
        "clip.json",
        "truth/shard-000000.tar",
    ] {
        assert!(file("clip", name) == file("again", name), "{name}");
    }
    assert!(file("clip", "frame-00000.png") != file("clip", "frame-00001.png"));
    let description = json(&folder.path().join("clip/clip.json"));
    assert_eq!(
        (description["event"].as_str(), description["synthetic"].as_bool()),
        (Some("still"), Some(true))
    );
    // The truth is a data set like any other.
    let eval = [
        "eval",
        "--model",
        "model",
        "--dataset",
        "clip/truth",
        "--json",
        "figures.json",
    ];
    deepsft(folder.path(), &eval).succeeds();
    assert_eq!(json(&folder.path().join("figures.json"))["frames"].as_u64(), Some(5));
    let long = [&options[..], &["--exposure-ms", "50", "--out", "long"]].concat();
    deepsft(folder.path(), &[&["clip"], long.as_slice()].concat()).fails(USAGE, &["--exposure-ms", "33.3"]);
}

#[test]
fn the_shipped_model_follows_the_sheet_through_a_clip() {
    let folder = tempfile::tempdir().unwrap();
    let model = shipped_model();
    // Frames twice as fine as the canonical image: through the warp.
    clip(
        folder.path(),
        &["--model", &model, "--frames", "24", "--scale", "2"],
        "clip",
    );
    let run = track(folder.path(), &model, &["--pictures", "--meshes", "clip"]);
    assert!(run.succeeds().stdout.contains("registration RMSE"), "{}", run.stdout);
    let report = json(&folder.path().join("track/track.json"));
    // The first answer is there at the fifth frame; from then on the sheet is found.
    assert_eq!(report["frames"].as_u64(), Some(24));
    assert!(report["found"].as_u64().unwrap() >= 18, "{}", report["found"]);
    let frames = report["per_frame"].as_array().unwrap();
    assert!(frames[..4].iter().all(|frame| frame["found"] == false));
    assert_eq!(frames[4]["detection"]["of_frame"].as_u64(), Some(0));
    assert_eq!(frames[4]["detection"]["by"].as_str(), Some("network"));
    // A track that is lost is off by tens of pixels.
    let errors = &report["errors"];
    assert!(errors["tracked"].as_u64().unwrap() >= 16, "{errors}");
    assert!(
        errors["registration_rmse_px"]["median"].as_f64().unwrap() < 1.5,
        "{errors}"
    );
    assert!(errors["points_rmse_mm"]["median"].as_f64().unwrap() < 15.0, "{errors}");
    // A table with a line a frame, a picture a frame, a mesh where the sheet is found.
    let table = fs::read_to_string(folder.path().join("track/track.csv")).unwrap();
    assert_eq!(table.lines().count(), 25);
    let columns = table.lines().next().unwrap().split(',').count();
    assert!(table.lines().all(|line| line.split(',').count() == columns), "{table}");
    let count = |name: &str| fs::read_dir(folder.path().join("track").join(name)).unwrap().count() as u64;
    assert_eq!(
        (count("pictures"), count("meshes")),
        (24, report["found"].as_u64().unwrap())
    );
    let picture = fs::read(folder.path().join("track/pictures/frame-00020.png")).unwrap();
    let original = fs::read(folder.path().join("clip/frame-00020.png")).unwrap();
    let [picture, original] = [picture, original].map(|bytes| deepsft::decode_picture(&bytes).unwrap());
    assert_eq!(picture.width(), 960);
    assert!(picture != original);
    // 24 frames of some vertices with three coordinates: no number in the first, millimetres in the last.
    let npy = fs::read(folder.path().join("track/vertices.npy")).unwrap();
    let end = 10 + usize::from(u16::from_le_bytes([npy[8], npy[9]]));
    let (values, rest) = npy[end..].as_chunks::<4>();
    assert!(rest.is_empty() && values.len() % (24 * 3) == 0);
    let values: Vec<f32> = values.iter().map(|bytes| f32::from_le_bytes(*bytes)).collect();
    assert!(values[0].is_nan());
    assert!((100.0..1500.0).contains(values.last().unwrap()), "{:?}", values.last());
}

#[test]
fn a_network_that_is_waited_for_finds_the_sheet_in_the_first_frame() {
    let folder = tempfile::tempdir().unwrap();
    let model = shipped_model();
    clip(
        folder.path(),
        &["--model", &model, "--frames", "3", "--event", "still"],
        "clip",
    );
    track(folder.path(), &model, &["--find-every", "1", "--smooth", "clip"]).succeeds();
    let report = json(&folder.path().join("track/track.json"));
    assert_eq!(
        (report["found"].as_u64(), report["smoothed"].as_bool()),
        (Some(3), Some(true))
    );
    track(folder.path(), &model, &["--find-every", "1", "--delay", "2", "clip"]).fails(USAGE, &["--delay"]);
}

#[test]
fn a_picture_is_followed_and_reconstructed_without_any_training() {
    let folder = tempfile::tempdir().unwrap();
    let picture = format!("{}/template/texture.png", shipped_model());
    let printed = ["--picture", &picture, "--size-mm", "297x210"];
    let clip = ["clip", "--frames", "24", "--scale", "2", "--seed", "5", "--out", "clip"];
    deepsft(folder.path(), &[&clip[..], &printed].concat()).succeeds();
    let track = ["track", "--out", "track", "clip"];
    deepsft(folder.path(), &[&track[..], &printed].concat()).succeeds();
    let report = json(&folder.path().join("track/track.json"));
    assert!(
        report["device"].is_null() && report["found"].as_u64().unwrap() >= 18,
        "{report}"
    );
    let detection = &report["per_frame"][4]["detection"];
    assert_eq!(
        (detection["by"].as_str(), detection["effect"].as_str()),
        (Some("features"), Some("started"))
    );
    let errors = &report["errors"];
    assert!(errors["tracked"].as_u64().unwrap() >= 16, "{errors}");
    assert!(
        errors["registration_rmse_px"]["median"].as_f64().unwrap() < 1.5,
        "{errors}"
    );

    let reconstruct = [
        "reconstruct",
        "--camera",
        "clip/camera.json",
        "--out",
        "results",
        "clip/frame-00010.png",
    ];
    deepsft(folder.path(), &[&reconstruct[..], &printed].concat()).succeeds();
    let report = json(&folder.path().join("results/frame-00010/report.json"));
    assert_eq!(
        (report["found"].as_bool(), report["found_by"].as_str()),
        (Some(true), Some("features"))
    );
    assert!(folder.path().join("results/frame-00010/whole-mesh.glb").exists());
    // Another size of the print is another distance; sides that do not fit the picture are refused.
    let size = |size| ["--picture", &picture, "--size-mm", size];
    deepsft(folder.path(), &[&reconstruct[..], &size("594x420")].concat()).succeeds();
    let twice = json(&folder.path().join("results/frame-00010/report.json"));
    let depth = |report: &Value| report["depth_mm"][1].as_f64().unwrap();
    assert!(
        (depth(&twice) / depth(&report) - 2.0).abs() < 0.1,
        "{} {}",
        depth(&twice),
        depth(&report)
    );
    deepsft(folder.path(), &[&reconstruct[..], &size("210x297")].concat())
        .fails(INVALID_INPUT, &["texture.png", "210 x 297"]);
    deepsft(folder.path(), &[&reconstruct[..], &["--picture", &picture]].concat()).fails(USAGE, &["--size-mm"]);
    deepsft(
        folder.path(),
        &[&reconstruct[..], &printed, &["--mesh", "none"]].concat(),
    )
    .fails(USAGE, &["--model"]);
}

#[test]
fn where_nothing_is_found_the_mesh_is_not_a_number() {
    let folder = tempfile::tempdir().unwrap();
    write_bundle(folder.path(), "model");
    write_stream(&folder.path().join("video.y4m"), 6);
    track(folder.path(), "model", &["--pictures", "video.y4m"]).succeeds();
    let report = json(&folder.path().join("track/track.json"));
    assert_eq!(
        (report["frames"].as_u64(), report["found"].as_u64()),
        (Some(6), Some(0))
    );
    assert_eq!(report["frames_per_s"].as_f64(), Some(25.0));
    assert_eq!(report["camera"]["source"].as_str(), Some("assumed"));
    assert!(report["errors"].is_null());
    let npy = fs::read(folder.path().join("track/vertices.npy")).unwrap();
    let end = 10 + usize::from(u16::from_le_bytes([npy[8], npy[9]]));
    assert!(
        npy[end..]
            .as_chunks::<4>()
            .0
            .iter()
            .all(|bytes| f32::from_le_bytes(*bytes).is_nan())
    );
}

#[test]
fn what_is_no_video_is_refused_and_nothing_is_written() {
    let folder = tempfile::tempdir().unwrap();
    write_bundle(folder.path(), "model");
    let path = folder.path();
    fs::create_dir(path.join("empty")).unwrap();
    track(path, "model", &["empty"]).fails(INVALID_INPUT, &["folder of frames empty", "no picture in it"]);
    track(path, "model", &["nowhere.mp4"]).fails(INVALID_INPUT, &["video nowhere.mp4", "no such file"]);

    for name in ["f1.png", "f2.png", "f3.png"] {
        write_frame(&path.join("broken"), name, 64);
    }
    let good = fs::read(path.join("broken/f2.png")).unwrap();
    fs::write(path.join("broken/f2.png"), &good[..good.len() / 2]).unwrap();
    fs::rename(path.join("broken/f2.png"), path.join("broken/f0.png")).unwrap();
    track(path, "model", &["broken"]).fails(INVALID_INPUT, &["broken/f0.png", "cannot be read"]);

    write_stream(&path.join("cut.y4m"), 1);
    let whole = fs::read(path.join("cut.y4m")).unwrap();
    fs::write(path.join("cut.y4m"), &whole[..whole.len() - 9]).unwrap();
    track(path, "model", &["cut.y4m"]).fails(INVALID_INPUT, &["video cut.y4m", "within a frame"]);
    fs::write(
        path.join("vast.y4m"),
        "YUV4MPEG2 W4294967296 H4294967296 F30:1 Cmono\nFRAME\n",
    )
    .unwrap();
    track(path, "model", &["vast.y4m"]).fails(INVALID_INPUT, &["video vast.y4m", "4294967296 pixels"]);

    let camera = r#"{"width": 640, "height": 480, "fx": 500.0, "fy": 500.0, "cx": 320.0, "cy": 240.0}"#;
    write_files(path, &[("camera.json".to_owned(), camera.into())].into());
    write_frame(&path.join("frames"), "f1.png", 64);
    track(path, "model", &["--camera", "camera.json", "frames"])
        .fails(INVALID_INPUT, &["camera file camera.json", "640 x 480"]);
    assert!(!path.join("track").exists());
    fs::create_dir(path.join("track")).unwrap();
    fs::write(path.join("track/thesis.txt"), "mine").unwrap();
    track(path, "model", &["frames"]).fails(FAILED, &["track", "holds no track.json"]);
}

/// Checks that the track in `folder` has so many frames, in all its files, and ends early for a reason of these `parts`; and
/// that nothing else was left beside it.
fn ended_early(folder: &Path, frames: usize, parts: &[&str]) {
    ended_early_in(folder, "track", frames, parts);
}

/// The same of the track `name`.
pub fn ended_early_in(folder: &Path, name: &str, frames: usize, parts: &[&str]) {
    let track = folder.join(name);
    let report = json(&track.join("track.json"));
    let reason = report["ended_early"].as_str().unwrap();
    assert!(parts.iter().all(|part| reason.contains(part)), "{reason}");
    assert_eq!(report["frames"].as_u64(), Some(frames as u64));
    assert_eq!(report["per_frame"].as_array().unwrap().len(), frames);
    let table = fs::read_to_string(track.join("track.csv")).unwrap();
    assert_eq!(table.lines().count(), frames + 1);
    let npy = fs::read(track.join("vertices.npy")).unwrap();
    assert!(String::from_utf8_lossy(&npy[..128]).contains(&format!("({frames}, ")));
    let vertices = template().mesh().vertices().len();
    assert_eq!(npy.len(), 128 + 4 * 3 * frames * vertices);
    let mut entries = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().file_name());
    assert!(!entries.any(|name| name.to_string_lossy().starts_with('.')));
}

#[test]
fn a_video_that_ends_in_an_error_leaves_the_frames_before_and_the_reason() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    write_bundle(path, "model");
    write_stream(&path.join("cut.y4m"), 3);
    let whole = fs::read(path.join("cut.y4m")).unwrap();
    fs::write(path.join("cut.y4m"), &whole[..whole.len() - 9]).unwrap();
    track(path, "model", &["--pictures", "cut.y4m"]).fails(INVALID_INPUT, &["video cut.y4m", "within a frame"]);
    ended_early(path, 2, &["cut.y4m", "within a frame"]);
    assert_eq!(fs::read_dir(path.join("track/pictures")).unwrap().count(), 2);

    for name in ["f1.png", "f2.png", "f3.png"] {
        write_frame(&path.join("mixed"), name, if name == "f3.png" { 60 } else { 64 });
    }
    const DIFFERENT: &str = "60 x 36 pixels, the frames before it 64 x 36";
    track(path, "model", &["mixed"]).fails(INVALID_INPUT, &["mixed/f3.png", DIFFERENT]);
    ended_early(path, 2, &["mixed/f3.png"]);
    // A video that is whole says nothing of the kind.
    write_stream(&path.join("whole.y4m"), 2);
    track(path, "model", &["whole.y4m"]).succeeds();
    assert!(json(&path.join("track/track.json")).get("ended_early").is_none());
}

#[test]
fn a_track_that_ends_early_does_not_replace_one_that_is_whole() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    write_bundle(path, "model");
    write_stream(&path.join("video.y4m"), 4);
    let whole = fs::read(path.join("video.y4m")).unwrap();
    let cut = |bytes: usize| fs::write(path.join("video.y4m"), &whole[..whole.len() - bytes]).unwrap();
    let frame = b"FRAME\n".len() + 64 * 36;
    let frames = || json(&path.join("track/track.json"))["frames"].as_u64();

    // Of two that end early the later one stays.
    for missing in [2, 1] {
        cut(missing * frame - 1);
        track(path, "model", &["video.y4m"]).fails(INVALID_INPUT, &["within a frame"]);
        ended_early(path, 4 - missing, &["within a frame"]);
    }
    assert!(!path.join("track.partial").exists());
    cut(0);
    track(path, "model", &["video.y4m"]).succeeds();
    assert_eq!(frames(), Some(4));
    for missing in [1, 2] {
        cut(missing * frame - 1);
        let run = track(path, "model", &["video.y4m"]);
        run.fails(INVALID_INPUT, &["within a frame"]);
        for part in [
            "track.partial holds the frames until then",
            "track keeps its older track",
        ] {
            assert!(run.stdout.contains(part), "{part:?} is not in: {}", run.stdout);
        }
        assert_eq!(frames(), Some(4), "the whole track was replaced");
        ended_early_in(path, "track.partial", 4 - missing, &["within a frame"]);
    }
    // The next whole track makes it outdated, but for what somebody put there.
    cut(0);
    fs::write(path.join("track.partial/thesis.txt"), "mine").unwrap();
    track(path, "model", &["video.y4m"]).succeeds();
    let left = fs::read_dir(path.join("track.partial")).unwrap();
    let left: Vec<_> = left.map(|entry| entry.unwrap().file_name()).collect();
    assert_eq!(left, ["thesis.txt"]);
    // That is not ours to replace: the command says so before it tracks a frame.
    cut(1);
    track(path, "model", &["video.y4m"]).fails(FAILED, &["track.partial", "holds no track.json"]);
    assert_eq!(
        (frames(), fs::read(path.join("track.partial/thesis.txt")).unwrap()),
        (Some(4), b"mine".to_vec())
    );
    fs::remove_file(path.join("track.partial/thesis.txt")).unwrap();
    track(path, "model", &["video.y4m"]).fails(INVALID_INPUT, &["within a frame"]);
    cut(0);
    track(path, "model", &["video.y4m"]).succeeds();
    assert!(!path.join("track.partial").exists());
}

#[cfg(unix)]
#[test]
fn ctrl_c_keeps_the_frames_until_then_and_leaves_no_litter() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    write_bundle(path, "model");
    write_stream(&path.join("long.y4m"), 20_000);
    let mut running = Command::new(env!("CARGO_BIN_EXE_deepsft"))
        .args(["track", "--model", "model", "--pictures", "--out", "track", "long.y4m"])
        .current_dir(path)
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    let begun = || path.join(".track.partial/pictures/frame-00002.png").is_file();
    let start = Instant::now();
    while !begun() {
        assert!(start.elapsed() < PATIENCE && running.try_wait().unwrap().is_none());
        sleep(Duration::from_millis(5));
    }
    let asked = Command::new("kill").args(["-INT", &running.id().to_string()]).status();
    assert!(asked.unwrap().success());
    assert_eq!(running.wait().unwrap().code(), Some(130));
    let frames = json(&path.join("track/track.json"))["frames"].as_u64().unwrap();
    assert!((3..20_000).contains(&frames), "{frames}");
    ended_early(path, frames as usize, &["interrupted"]);
}

#[test]
fn a_clip_of_another_template_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    write_template(folder.path(), "template");
    clip(folder.path(), &["--template", "template", "--frames", "1"], "clip");
    track(folder.path(), &shipped_model(), &["clip"]).fails(INVALID_INPUT, &["clip", "200 x 150 mm", "297"]);
}

#[test]
fn a_sheet_that_moves_and_bends_tells_what_its_camera_is() {
    let folder = tempfile::tempdir().unwrap();
    let (folder, model) = (folder.path(), shipped_model());
    clip(folder, &["--model", &model, "--frames", "24", "--fps", "12"], "clip");
    // The camera that is assumed has a focal length that is a fifth too short.
    let mut camera = json(&folder.join("clip/camera.json"));
    let truth = camera["fx"].as_f64().unwrap();
    for name in ["fx", "fy"] {
        camera[name] = (0.8 * truth).into();
    }
    fs::write(folder.join("assumed.json"), camera.to_string()).unwrap();
    let options = [
        "--camera",
        "assumed.json",
        "--find-every",
        "1",
        "--write-camera",
        "found.json",
        "clip",
    ];
    let run = track(folder, &model, &options);
    assert!(run.succeeds().stdout.contains("focal length"), "{}", run.stdout);
    let error = json(&folder.join("found.json"))["fx"].as_f64().unwrap() / truth - 1.0;
    assert!(error.abs() < 0.03, "{error}: {}", run.stdout);
}
