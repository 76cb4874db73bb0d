//! Videos that the program ffmpeg decodes.

use crate::common::{deepsft_with_path, write_bundle};
use crate::tracking::{FAILED, INVALID_INPUT, ended_early_in, json, write_stream};
use std::fs;
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
    program("/bin/cat stream; echo 'moov atom not found' >&2; exit 1");
    deepsft_with_path(path, &path.join("bin"), &arguments)
        .fails(INVALID_INPUT, &["video video.mp4", "ffmpeg: moov atom not found"]);
    // Of a video that was cut short it decodes what is there, complains, and ends as if all were well.
    program("/bin/cat stream; echo 'Invalid NAL unit size' >&2; echo 'partial file' >&2; exit 0");
    deepsft_with_path(path, &path.join("bin"), &arguments).fails(
        INVALID_INPUT,
        &["video video.mp4", "ffmpeg: Invalid NAL unit size; partial file"],
    );
    ended_early_in(path, "track.partial", 3, &["Invalid NAL unit size"]);
    // A complaint is harmless where all frames came that the file announces.
    let complaining = "/bin/cat stream; echo 'EOI missing, emulating' >&2; echo frame=3 >&2; echo progress=end >&2";
    program(complaining);
    named("ffprobe", "case \"$*\" in *file:video.mp4*) echo 3;; *) exit 9;; esac");
    let run = deepsft_with_path(path, &path.join("bin"), &arguments);
    let said = &run.succeeds().stderr;
    assert!(
        said.contains("warning: video.mp4") && said.contains("all 3 frames") && said.contains("EOI missing"),
        "{said}"
    );
    named("ffprobe", "echo 4");
    deepsft_with_path(path, &path.join("bin"), &arguments).fails(INVALID_INPUT, &["ffmpeg: EOI missing, emulating"]);
    program("exit 7");
    deepsft_with_path(path, &path.join("bin"), &arguments).fails(INVALID_INPUT, &["video video.mp4", "ffmpeg"]);
}
