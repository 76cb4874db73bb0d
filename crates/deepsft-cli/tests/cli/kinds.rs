//! What people bring: one small file of each kind, and what becomes of it.

use crate::common::{art, deepsft};
use deepsft::encode_png;
use std::fs;
use std::path::Path;
use std::process::Command;

const INVALID_INPUT: i32 = 3;

/// What becomes of a file: it is read, with these words said, or refused with these words.
enum Outcome {
    Read(&'static [&'static str]),
    Refused(&'static [&'static str]),
}
use Outcome::{Read, Refused};

const PICTURE: &str = "template new --size-mm 40x30 --out sheet --image";
const SCAN: &str = "template import --out scan";
const CAMERA: &str = "camera import --out read.json";
const BOARD: &str = "camera calibrate --checkerboard --out c.json";
const VIDEO: &str = "track --picture print.png --size-mm 40x30 --out track";

const ROS: &str = "image_width: 640\nimage_height: 480\ncamera_matrix:\n  rows: 3\n  cols: 3\n  data: [500, 0, 320, 0, 500, 240, 0, 0, 1]\n\
                   distortion_model: plumb_bob\ndistortion_coefficients:\n  rows: 1\n  cols: 5\n  data: [0.1, -0.05, 0, 0, 0]\n";
const SHEET: &str = "v 0 0 0\nv 40 0 0\nv 40 30 0\nv 0 30 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nf 1/1 2/2 3/3 4/4\n";
/// With the MTL of somebody else's disk.
const FOREIGN: &str = "newmtl print\nmap_Kd C:\\Users\\me\\print.png\n";

fn ffmpeg(folder: &Path, line: &str) {
    let made = Command::new("ffmpeg")
        .args(["-v", "error", "-y"])
        .args(line.split(' '))
        .current_dir(folder)
        .status();
    assert!(made.expect("the tests need ffmpeg").success(), "{line}");
}

/// The files, each in the table below.
fn make(folder: &Path) {
    let write = |name: &str, bytes: &[u8]| fs::write(folder.join(name), bytes).unwrap();
    let jpeg = deepsft_formats::encode_jpeg(&art(), 90).unwrap();
    write("print.png", &encode_png(&art()).unwrap());
    write("print.jpg", &jpeg);
    write("cut.jpg", &jpeg[..jpeg.len() / 2]);
    write("empty.png", b"");
    write("page.png", b"<!DOCTYPE html>");
    for name in ["print.webp", "print.bmp", "print.tiff", "print.gif"] {
        ffmpeg(folder, &format!("-i print.png {name}"));
    }
    ffmpeg(
        folder,
        "-i print.png -frames:v 1 -pix_fmt yuv420p -c:v libaom-av1 -still-picture 1 -cpu-used 8 phone.avif",
    );
    // A picture of many tiles, of which an ffmpeg decodes one: it announces more pixels than come.
    let mut tile = fs::read(folder.join("phone.avif")).unwrap();
    let size = tile.windows(4).position(|name| name == b"ispe").unwrap() + 8;
    tile[size..size + 8].copy_from_slice(&[0, 0, 16, 0, 0, 0, 12, 0]);
    write("tiles.heic", &tile);
    write("phone.heic", b"\0\0\0\x18ftypheic\0\0\0\0mif1heic");

    write("ros.yaml", ROS.as_bytes());
    write(
        "cameras.txt",
        b"# COLMAP\n1 OPENCV 640 480 500 500 320 240 0.1 -0.05 0 0\n",
    );
    write(
        "ours.json",
        br#"{"width": 640, "height": 480, "fx": 500, "fy": 500, "cx": 320, "cy": 240}"#,
    );
    write("fov.txt", b"1 FOV 640 480 500 500 320 240 0.9\n");
    write("words.yaml", b"my camera is a good one\n");

    write(
        "sheet.obj",
        format!("mtllib sheet.mtl\nusemtl print\n{SHEET}").as_bytes(),
    );
    write("sheet.mtl", FOREIGN.as_bytes());
    write("lost.obj", format!("mtllib lost.mtl\nusemtl print\n{SHEET}").as_bytes());
    write("lost.mtl", FOREIGN.replace("print.png", "gone.png").as_bytes());
    write("scan.zip", b"PK\x03\x04");

    let video = "-loop 1 -framerate 10 -t 0.5 -i print.png -vf scale=161:121";
    ffmpeg(folder, &format!("{video} -c:v mpeg4 -q:v 2 phone.mp4"));
    ffmpeg(folder, &format!("{video} -c:v mjpeg -q:v 2 webcam.avi"));
    ffmpeg(folder, "-f lavfi -t 0.2 -i anullsrc sound.wav");
    let movie = fs::read(folder.join("phone.mp4")).unwrap();
    write("cut.mp4", &movie[..movie.len() / 2]);
    write("empty.mp4", b"");
}

#[test]
fn each_kind_of_file_is_read_or_refused_with_file_cause_and_remedy() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    make(folder);
    #[rustfmt::skip]
    let table = [
        // Pictures.
        ("print.png", PICTURE, Read(&[])),
        ("print.jpg", PICTURE, Read(&[])),
        ("print.webp", PICTURE, Read(&[])),
        ("print.bmp", PICTURE, Read(&[])),
        ("print.tiff", PICTURE, Read(&[])),
        ("print.gif", PICTURE, Read(&[])),
        ("phone.avif", PICTURE, Read(&[])),
        ("tiles.heic", PICTURE, Refused(&["a tile of 120 x 90 of its 4096 x 3072 pixels", "ffmpeg 7.1", "export it as JPEG"])),
        ("phone.heic", PICTURE, Refused(&["HEIC", "export it as JPEG", "Most Compatible"])),
        ("cut.jpg", PICTURE, Refused(&["cut short", "last rows are missing", "copy it again"])),
        ("empty.png", PICTURE, Refused(&["empty (0 bytes)", "copy it again"])),
        ("page.png", PICTURE, Refused(&["no kind that is read: PNG, JPEG"])),
        ("gone.png", PICTURE, Refused(&["No such file"])),
        // Cameras.
        ("ours.json", CAMERA, Read(&["640 x 480", "320.00, 240.00"])),
        ("ros.yaml", CAMERA, Read(&["640 x 480", "320.50, 240.50", "0.10000, -0.05000"])),
        ("cameras.txt", CAMERA, Read(&["320.00, 240.00", "0.10000, -0.05000"])),
        ("fov.txt", CAMERA, Refused(&["FOV"])),
        ("words.yaml", CAMERA, Refused(&["camera"])),
        // Scans.
        ("sheet.obj", SCAN, Read(&["print.png"])),
        ("lost.obj", SCAN, Refused(&["gone.png"])),
        ("scan.zip", SCAN, Refused(&["unpack a ZIP first"])),
        // Photographs of a board, and videos of it.
        ("print.jpg", BOARD, Refused(&["no checkerboard was seen", "circles are not read"])),
        ("phone.mp4", BOARD, Refused(&["no checkerboard was seen"])),
        ("tiles.heic", BOARD, Refused(&["no photograph that can be used"])),
        // Videos.
        ("phone.mp4", VIDEO, Read(&["5 frames"])),
        ("webcam.avi", VIDEO, Read(&["5 frames"])),
        ("sound.wav", VIDEO, Refused(&["no video in it", "choose another file"])),
        ("cut.mp4", VIDEO, Refused(&["moov atom not found", "copy the file again"])),
        ("empty.mp4", VIDEO, Refused(&["empty (0 bytes)", "copy it again"])),
        ("page.png", VIDEO, Refused(&["ffmpeg"])),
    ];
    for (name, command, outcome) in table {
        let arguments: Vec<&str> = command.split(' ').chain([name]).collect();
        let run = deepsft(folder, &arguments);
        let (code, words) = match outcome {
            Read(words) => (0, words),
            Refused(words) => (INVALID_INPUT, words),
        };
        assert_eq!(run.code, code, "{command} {name}: {run:?}");
        let said = format!("{}{}", run.stdout, run.stderr);
        for words in words {
            assert!(said.contains(words), "{command} {name}: {words:?} is not in {said}");
        }
        if code != 0 {
            let refusals: Vec<_> = run.stderr.lines().filter(|line| line.starts_with("error: ")).collect();
            assert!(
                refusals.len() == 1 && refusals[0].contains(name),
                "{command} {name}: {}",
                run.stderr
            );
            println!("{}", run.stderr.trim());
        }
    }
}
