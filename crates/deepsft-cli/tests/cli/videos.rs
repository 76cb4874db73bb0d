//! Videos that the program ffmpeg decodes.

use crate::common::{deepsft, deepsft_with_path, write_bundle};
use crate::tracking::{FAILED, INVALID_INPUT, ended_early_in, json, write_stream};
use std::fs;
use std::process::Command;

#[test]
fn a_video_needs_ffmpeg_and_the_refusal_says_so() {
    let folder = tempfile::tempdir().unwrap();
    write_bundle(folder.path(), "model");
    fs::write(folder.path().join("video.mp4"), "not decoded by us").unwrap();
    fs::create_dir(folder.path().join("bin")).unwrap();
    let arguments = ["track", "--model", "model", "--out", "track", "video.mp4"];
    deepsft_with_path(folder.path(), &folder.path().join("bin"), &arguments)
        .fails(FAILED, &["video.mp4", "ffmpeg", "not on the PATH", "install"]);
    assert!(!folder.path().join("track").exists());
}

/// A program of the name in the tests' place: what it says and how it ends is what matters, not what it decodes.
#[cfg(unix)]
#[test]
fn what_ffmpeg_decodes_is_tracked_and_what_it_complains_about_is_told() {
    use std::os::unix::fs::PermissionsExt;
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    write_bundle(path, "model");
    write_stream(&path.join("stream"), 3);
    fs::write(path.join("video.mp4"), "not decoded by us").unwrap();
    fs::create_dir(path.join("bin")).unwrap();
    let named = |name: &str, script: &str| {
        let file = path.join("bin").join(name);
        fs::write(&file, format!("#!/bin/sh\n{script}\n")).unwrap();
        fs::set_permissions(&file, fs::Permissions::from_mode(0o755)).unwrap();
    };
    let program = |script: &str| named("ffmpeg", script);
    let arguments = ["track", "--model", "model", "--out", "track", "video.mp4"];
    // It is told the file, as a file.
    program("case \"$*\" in *file:video.mp4*) exec /bin/cat stream;; *) exit 9;; esac");
    deepsft_with_path(path, &path.join("bin"), &arguments).succeeds();
    assert_eq!(json(&path.join("track/track.json"))["frames"].as_u64(), Some(3));
    program("/bin/cat stream; echo '[mov @ 0x1] [error] moov atom not found' >&2; exit 1");
    deepsft_with_path(path, &path.join("bin"), &arguments).fails(
        INVALID_INPUT,
        &["video video.mp4", "ffmpeg: [mov @ 0x1] moov atom not found"],
    );
    // Of a video that was cut short it decodes what is there, complains, and ends as if all were well.
    program("/bin/cat stream; echo '[error] Invalid NAL unit size' >&2; echo '[error] partial file' >&2; exit 0");
    deepsft_with_path(path, &path.join("bin"), &arguments).fails(
        INVALID_INPUT,
        &["video video.mp4", "ffmpeg: Invalid NAL unit size; partial file"],
    );
    ended_early_in(path, "track.partial", 3, &["Invalid NAL unit size"]);
    // Who asks for a video of a high range is told what its ffmpeg lacks.
    program("case \"$*\" in *-filters*) echo scale;; *zscale*) exit 9;; *) exec /bin/cat stream;; esac");
    named(
        "ffprobe",
        "echo '{\"streams\":[{\"color_transfer\":\"arib-std-b67\"}]}'",
    );
    let run = deepsft_with_path(path, &path.join("bin"), &arguments);
    let said = &run.succeeds().stderr;
    assert!(
        said.contains("warning: video.mp4") && said.contains("HLG") && said.contains("no filter zscale"),
        "{said}"
    );
    program("echo 'ffmpeg: no libavcodec.so' >&2; exit 127");
    deepsft_with_path(path, &path.join("bin"), &arguments)
        .fails(INVALID_INPUT, &["video video.mp4", "no libavcodec.so"]);
    program("exit 7");
    deepsft_with_path(path, &path.join("bin"), &arguments).fails(INVALID_INPUT, &["video video.mp4", "ffmpeg"]);
}

#[test]
fn the_times_of_a_track_are_those_of_the_container() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    write_bundle(path, "model");
    write_stream(&path.join("stream.y4m"), 4);
    let made = Command::new("ffmpeg")
        .args([
            "-v",
            "error",
            "-i",
            "stream.y4m",
            "-vf",
            "settb=1/1000,setpts=N*N/10/TB",
            "-vsync",
            "passthrough",
        ])
        .args(["-enc_time_base", "1/1000", "-c:v", "ffv1", "video.mkv"])
        .current_dir(path)
        .status();
    assert!(made.unwrap().success());
    let arguments = ["track", "--model", "model", "--out", "track", "video.mkv"];
    deepsft(path, &arguments).succeeds();
    let report = json(&path.join("track/track.json"));
    let times = report["per_frame"]
        .as_array()
        .unwrap()
        .iter()
        .map(|frame| frame["time_s"].as_f64().unwrap());
    assert_eq!(times.collect::<Vec<_>>(), [0.0, 0.1, 0.4, 0.9]);
}
