//! Each refusal is one sentence with file, cause and remedy, and an exit code as documented; nothing of the user's is touched.

use crate::common::{art, deepsft, write_bundle, write_photograph, write_template};
use deepsft::encode_png;
use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

const FAILED: i32 = 1;
const INVALID_INPUT: i32 = 3;

const OPENCV: &str = "%YAML:1.0\n---\nimage_width: 640\nimage_height: 360\ncamera_matrix: !!opencv-matrix\n   rows: 3\n   cols: 3\n   \
                      dt: d\n   data: [500., 0., 320., 0., 500., 180., 0., 0., 1.]\n";
const KALIBR: &str =
    "cam0:\n  camera_model: ds\n  intrinsics: [0.1, 0.5, 500, 500, 320, 180]\n  resolution: [640, 360]\n";
const TRIANGLE: &str =
    "mtllib t.mtl\nusemtl print\nv 0 0 0\nv 40 0 0\nv 0 40 0\nvt 0 0\nvt 1 0\nvt 0 1\nf 1/1 2/2 3/3\n";

/// Files that people bring, by name.
fn bring(folder: &Path) {
    let print = encode_png(&art()).unwrap();
    let mut damaged = print.clone();
    damaged[print.len() / 2] ^= 0x55;
    let texts = [
        ("web.png", "<html>404</html>"),
        ("matrix.yml", &OPENCV.replace(", 1.]", "]")),
        ("tab.yml", "image_width: 640\n\timage_height 360: [\n"),
        ("kalibr.yaml", KALIBR),
        ("colmap.txt", "1 PINHOLE 640 360 500 many 320 180\n"),
        ("cut.json", "{\"width\": 640,"),
        ("empty.json", ""),
        ("empty.glb", ""),
        ("text.glb", "hello"),
        ("cut.y4m", "YUV4MPEG2 W4 H4 F30:1\nFRAME\nxx"),
        ("lost.obj", TRIANGLE),
        ("t.mtl", "newmtl print\nmap_Kd gone.png\n"),
        ("mine/thesis.tex", "years of work"),
        ("model.checkpoint/state.json", "{"),
        (
            "wide/template.json",
            r#"{"format_version": 1, "kind": "thin-shell", "width_mm": 0, "height_mm": 9, "texture": "t.png"}"#,
        ),
        ("newer/template.json", r#"{"format_version": 9}"#),
    ];
    let bytes = [
        ("print.png", print.clone()),
        ("cut.png", print[..print.len() / 2].to_vec()),
        ("damaged.png", damaged),
        ("art.exr", b"\x76\x2f\x31\x01".to_vec()),
        ("cameras.bin", vec![0; 64]),
        ("wide/t.png", print),
    ];
    let texts = texts.map(|(name, text)| (name, text.as_bytes().to_vec()));
    for (name, bytes) in texts.into_iter().chain(bytes) {
        let path = folder.join(name);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(path, bytes).unwrap();
    }
    write_photograph(folder, "photo.png");
    write_template(folder, "template");
    write_bundle(folder, "bundle");
    fs::create_dir(folder.join("nothing")).unwrap();
}

/// All files in and below a folder, and their sizes.
fn files(folder: &Path) -> BTreeMap<String, u64> {
    let mut found = BTreeMap::new();
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            found.extend(files(&path));
        } else {
            found.insert(path.display().to_string(), path.metadata().unwrap().len());
        }
    }
    found
}

#[test]
fn each_refusal_names_file_cause_and_remedy() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    bring(folder);
    let before = files(folder);
    let refused = |command: &str, code: i32, parts: &[&str]| {
        let run = deepsft(folder, &command.split(' ').collect::<Vec<_>>());
        run.fails(code, parts);
        let told: Vec<_> = run
            .stderr
            .lines()
            .filter(|line| !line.starts_with("note: ") && !line.starts_with("warning: "))
            .collect();
        assert!(
            matches!(told[..], [line] if line.starts_with("error: ")),
            "{command}: {told:?}"
        );
        assert!(!run.stderr.contains("os error"), "{command}: {}", run.stderr);
        assert_eq!(files(folder), before, "{command}");
    };
    for (image, parts) in [
        ("gone.png", ["no such file", "check the path"]),
        ("nothing", ["it is a folder", "name a file"]),
        ("web.png", ["no kind that is read", "save it as one of these"]),
        ("cut.png", ["cut short", "copy it again"]),
        ("damaged.png", ["it is damaged", "save it anew as PNG"]),
        ("art.exr", ["not supported", "save it as PNG or JPEG"]),
    ] {
        let parts = [&[image][..], &parts].concat();
        refused(
            &format!("template new --size-mm 40x30 --out sheet --image {image}"),
            INVALID_INPUT,
            &parts,
        );
        refused(
            &format!("reconstruct --picture print.png --size-mm 40x30 --out r {image}"),
            INVALID_INPUT,
            &parts,
        );
    }
    for (file, parts) in [
        ("gone.json", ["no such file", "check the path"]),
        ("empty.json", ["it is empty", "copy it again"]),
        ("cut.json", ["it ends too early", "copy it again"]),
        ("cameras.bin", ["it is no text", "COLMAP's cameras.txt"]),
        ("print.png", ["it is no text", "JSON, YAML, XML"]),
        ("tab.yml", ["its YAML cannot be read", "correct it there"]),
        ("matrix.yml", ["its camera matrix has 8 numbers", "9 are expected"]),
        ("kalibr.yaml", ["lens model (ds)", "calibrate with pinhole"]),
        (
            "colmap.txt",
            ["\"many\" where a number is expected", "correct it there"],
        ),
    ] {
        let parts = [&[file][..], &parts].concat();
        refused(&format!("camera import --out read.json {file}"), INVALID_INPUT, &parts);
    }
    for (command, code, parts) in [
        (
            "template import --out s gone.obj",
            INVALID_INPUT,
            ["scan gone.obj: there is no such file", "check the path"],
        ),
        (
            "template import --out s nothing",
            INVALID_INPUT,
            ["scan nothing: it is a folder", "name a file in it"],
        ),
        (
            "template import --out s empty.glb",
            INVALID_INPUT,
            ["empty.glb: it is empty", "copy it again"],
        ),
        (
            "template import --out s text.glb",
            INVALID_INPUT,
            ["text.glb: it is no valid JSON", "copy it again"],
        ),
        (
            "template import --out s lost.obj",
            INVALID_INPUT,
            ["gone.png: there is no such file", "--texture"],
        ),
        (
            "clip --out c --template gone",
            INVALID_INPUT,
            ["template gone: there is no template.json", "name the folder"],
        ),
        (
            "clip --out c --template wide",
            INVALID_INPUT,
            ["wide/template.json: template width is 0 mm", "expected"],
        ),
        (
            "clip --out c --template newer",
            INVALID_INPUT,
            ["newer/template.json", "use a newer version"],
        ),
        (
            "bundle verify gone",
            INVALID_INPUT,
            ["gone: there is no such folder", "check the path"],
        ),
        (
            "bundle verify print.png",
            INVALID_INPUT,
            ["print.png: it is a file", "name the folder"],
        ),
        (
            "bundle verify template",
            INVALID_INPUT,
            ["lacks model.json", "name its folder"],
        ),
        (
            "network describe compakt",
            INVALID_INPUT,
            ["compakt: there is no such folder", "compact, paper, r50f"],
        ),
        (
            "track --template template --out t nothing",
            INVALID_INPUT,
            ["nothing: there is no picture", "put PNG or JPEG"],
        ),
        (
            "track --template template --out t cut.y4m",
            INVALID_INPUT,
            ["cut.y4m: it ends within a frame", "copy it again"],
        ),
        (
            "recording import --color nothing --depth nothing --camera kinect-v2 --out r",
            INVALID_INPUT,
            [
                "cannot use colour pictures nothing: there is none of them in it",
                "check the path",
            ],
        ),
        (
            "recording verify nothing",
            INVALID_INPUT,
            ["nothing/camera.json: there is no such file", "check the path"],
        ),
        (
            "eval --model bundle --data mine",
            INVALID_INPUT,
            ["mine/dataset.json: there is no such file", "check the path"],
        ),
        (
            "reconstruct --picture print.png --size-mm 1000000 --out r photo.png",
            INVALID_INPUT,
            [
                "print.png: print is 1000000 x 750000 mm",
                "expected sides from 5 to 20000 mm",
            ],
        ),
        (
            "camera calibrate --picture print.png --size-mm 1 --out c.json photo.png",
            INVALID_INPUT,
            ["print.png: print is 1 x 0.75 mm", "expected sides from 5 to 20000 mm"],
        ),
        (
            "reconstruct --template template --descriptors print.png --out r photo.png",
            INVALID_INPUT,
            ["print.png: it holds no weights", "models/any-picture/weights.bpk"],
        ),
        (
            "reconstruct --template template --camera kinect-v3 --out r photo.png",
            INVALID_INPUT,
            ["kinect-v3: there is no such file", "kinect-v2"],
        ),
        (
            "train --template template --out model --resume --samples 16",
            INVALID_INPUT,
            ["model.checkpoint/state.json: it ends too early", "copy it again"],
        ),
        (
            "train --template template --from nothing --out other --samples 16",
            INVALID_INPUT,
            ["nothing/weights.bpk: there is no such file", "check the path"],
        ),
        (
            "clip --template template --out print.png",
            FAILED,
            ["print.png: it is a file", "choose another name"],
        ),
        (
            "clip --template template --out print.png/c",
            FAILED,
            ["a part of its path is a file", "choose another folder"],
        ),
        (
            "clip --template template --out mine",
            FAILED,
            ["mine exists and holds no clip.json", "choose another folder"],
        ),
    ] {
        refused(command, code, &parts);
    }
}
