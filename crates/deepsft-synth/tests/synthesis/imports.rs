//! Recordings in the layouts of others: what was recorded comes back, what is wrong is named, what is somebody's own stays.

use deepsft_formats::{encode_jpeg, f32_npy};
use deepsft_geometry::glam::DVec2;
use deepsft_geometry::{Maps, Picture, Template, training_camera};
use deepsft_synth::{
    DatasetFolder, FramePairing, Recording, RecordingImport, RecordingSimulator, RecordingSource, RgbdSensor,
    SimulatedFrame, SynthError, TruthSource, encode_depth_png, encode_mask_png,
};
use std::fmt::Write;
use std::fs;
use std::ops::RangeInclusive;
use std::path::Path;
use std::sync::LazyLock;

const FRAMES: usize = 3;

static RECORDED: LazyLock<(Template, Vec<SimulatedFrame>)> = LazyLock::new(|| {
    let texture = Picture::from_fn(90, 60, |x, y| {
        [(x * 7 % 256) as u8, (y * 11 % 256) as u8, (x * y) as u8]
    });
    let template = Template::thin_shell(texture, 297.0, 210.0).unwrap();
    let simulator = RecordingSimulator::new(&template, false, 3).unwrap();
    let take = simulator.take(1);
    let frames = (0..FRAMES).map(|index| take.frame(index).unwrap()).collect();
    (template, frames)
});

fn write(folder: &Path, name: &str, bytes: &[u8]) {
    let path = folder.join(name);
    fs::create_dir_all(path.parent().unwrap()).unwrap();
    fs::write(path, bytes).unwrap();
}

/// Depth in the colour camera's image, `scale` units in a metre; `before` mm where the sheet is not seen.
fn depth(frame: &SimulatedFrame, scale: f32, before: f32) -> Vec<u16> {
    let units = |&mm: &f32| ((if mm > 0.0 { mm } else { before }) * scale / 1000.0).round() as u16;
    frame.color.truth.depth().iter().map(units).collect()
}

fn depth_png(frame: &SimulatedFrame, scale: f32, before: f32) -> Vec<u8> {
    encode_depth_png(&depth(frame, scale, before), &frame.color.camera).unwrap()
}

fn sensor(scale: f64) -> RgbdSensor {
    RgbdSensor {
        depth_scale: scale,
        ..RgbdSensor::registered(RECORDED.1[0].color.camera)
    }
}

/// Pictures `color/NNN.jpg` and `depth/NNN.png` in millimetres, from 1.
fn write_numbered(folder: &Path, before: f32) {
    for (index, frame) in RECORDED.1.iter().enumerate() {
        let jpeg = encode_jpeg(&frame.color.image, 95).unwrap();
        write(folder, &format!("color/frame_{:03}.jpg", index + 1), &jpeg);
        write(
            folder,
            &format!("depth/{}.png", index + 1),
            &depth_png(frame, 1000.0, before),
        );
    }
}

fn numbered(folder: &Path) -> RecordingSource {
    RecordingSource {
        color: folder.join("color"),
        depth: folder.join("depth"),
        masks: None,
        truth: None,
        pairing: FramePairing::Number,
        sensor: sensor(1000.0),
    }
}

fn with_truth(folder: &Path, mm_per_unit: f64) -> RecordingSource {
    let truth = TruthSource {
        files: folder.join("truth"),
        template: RECORDED.0.clone(),
        mm_per_unit,
    };
    RecordingSource {
        truth: Some(truth),
        ..numbered(folder)
    }
}

/// Imports to `out` in the folder.
fn import(folder: &Path, source: RecordingSource) -> Result<RecordingImport, SynthError> {
    let import = RecordingImport::open(source)?;
    import.write(&folder.join("out"), || Ok::<_, SynthError>(()))?;
    Ok(import)
}

/// The truths that were imported, beside the exact ones.
fn imported_truths(folder: &Path) -> Vec<(Maps, &'static Maps)> {
    let set = DatasetFolder::open(&folder.join("out/truth")).unwrap();
    set.description().check_template(&RECORDED.0).unwrap();
    let samples: Vec<_> = set.samples(training_camera()).unwrap().map(Result::unwrap).collect();
    assert_eq!(samples.len(), FRAMES);
    let exact = RECORDED.1.iter().map(|frame| &frame.truth.truth);
    samples.into_iter().map(|sample| sample.truth).zip(exact).collect()
}

/// Checks that depth is within a limit and registration within half as many pixels (of one pixel in a thousand within twice that), and which
/// fraction of the exact truth is missing, and at most too much. Data sets round depth by up to 0.05 mm.
fn check_truths(folder: &Path, limit_mm: f64, missing: RangeInclusive<f64>, extra: f64) {
    for (imported, exact) in imported_truths(folder) {
        let (mut away_mm, mut shifts_px) = (Vec::new(), Vec::new());
        for p in (0..exact.depth().len()).filter(|&p| exact.inside(p) && imported.inside(p)) {
            let depth = f64::from(exact.depth()[p]);
            away_mm.push((f64::from(imported.depth()[p]) - depth).abs());
            let shift_mm = ((imported.uv(p) - exact.uv(p)) * RECORDED.0.size_mm()).length();
            let shift_px = shift_mm * training_camera().focal().x / depth;
            shifts_px.push(shift_px);
        }
        for (figures, limit) in [(&mut away_mm, limit_mm), (&mut shifts_px, 0.5 * limit_mm)] {
            figures.sort_by(f64::total_cmp);
            let (most, worst) = (figures[figures.len() * 999 / 1000], figures[figures.len() - 1]);
            assert!(
                most < limit && worst < 2.0 * limit,
                "{most} and {worst}, expected {limit}"
            );
        }
        let part = |area: usize| (area - away_mm.len()) as f64 / exact.area() as f64;
        let (lost, added) = (part(exact.area()), part(imported.area()));
        assert!(
            missing.contains(&lost) && added <= extra,
            "{lost} is missing, {added} too much"
        );
    }
}

#[test]
fn tum_frames_are_paired_by_time_and_those_without_a_partner_are_named() {
    let folder = tempfile::tempdir().unwrap();
    let start = 1_305_031_102.175_304;
    // The second depth picture comes twice, the third colour picture alone.
    let depths = [(0, 0.0151), (1, 0.2 - 0.004), (1, 0.2 + 0.015), (2, 0.4 + 0.021)];
    for (index, frame) in RECORDED.1.iter().enumerate() {
        let name = format!("rgb/{:.6}.png", start + 0.2 * index as f64);
        write(
            folder.path(),
            &name,
            &deepsft_formats::encode_png(&frame.color.image).unwrap(),
        );
    }
    for (index, time) in depths {
        let bytes = depth_png(&RECORDED.1[index], 5000.0, 0.0);
        write(folder.path(), &format!("depth/{:.6}.png", start + time), &bytes);
    }
    // Another colour picture is 8 ms from the second depth picture, whose own is 4 ms from it.
    let name = format!("rgb/{:.6}.png", start + 0.2 - 0.012);
    write(
        folder.path(),
        &name,
        &deepsft_formats::encode_png(&RECORDED.1[0].color.image).unwrap(),
    );
    let source = RecordingSource {
        color: folder.path().join("rgb"),
        pairing: FramePairing::Time,
        sensor: sensor(5000.0),
        ..numbered(folder.path())
    };
    let imported = import(folder.path(), source.clone()).unwrap();
    let left_out: Vec<_> = imported
        .left_out()
        .iter()
        .map(|path| path.strip_prefix(folder.path()).unwrap())
        .collect();
    let expected = [
        "rgb/1305031102.363304.png",
        "rgb/1305031102.575304.png",
        "depth/1305031102.390304.png",
        "depth/1305031102.596304.png",
    ];
    assert_eq!(left_out, expected.map(Path::new));
    let recording = Recording::open(&folder.path().join("out")).unwrap();
    assert_eq!((recording.frames(), recording.has_masks()), (2, false));
    assert_eq!(recording.sensor(), &sensor(5000.0));
    for (index, frame) in RECORDED.1.iter().take(2).enumerate() {
        let file = fs::read(folder.path().join(format!("out/depth/{index:06}.png"))).unwrap();
        let stored = image::load_from_memory(&file).unwrap().into_luma16();
        assert_eq!(stored.into_raw(), depth(frame, 5000.0, 0.0));
        assert_eq!(
            recording.frame(index, &training_camera()).unwrap().image,
            frame.truth.image
        );
    }
    // Lists tell the times of files of other names, and go before them.
    let mut lists = [String::from("# time path\n"), String::new()];
    for index in 0..FRAMES {
        for (list, (kind, ending)) in lists.iter_mut().zip([("rgb", "jpg"), ("depth", "png")]) {
            let _ = writeln!(list, "{index}.5 {kind}/{index}.{ending}");
        }
        let frame = &RECORDED.1[index];
        write(
            folder.path(),
            &format!("rgb/{index}.jpg"),
            &encode_jpeg(&frame.color.image, 95).unwrap(),
        );
        write(
            folder.path(),
            &format!("depth/{index}.png"),
            &depth_png(frame, 5000.0, 0.0),
        );
    }
    write(folder.path(), "rgb.txt", lists[0].as_bytes());
    write(folder.path(), "associations.txt", lists[1].as_bytes());
    let imported = import(folder.path(), source).unwrap();
    assert_eq!((imported.frames(), imported.left_out().len()), (3, 8));
    // What the older import had is gone.
    assert!(!folder.path().join("out/rgb/000000.png").exists());
}

/// The vertices of a frame as lines `v x y z`, in metres.
fn vertex_lines(frame: &SimulatedFrame, decimals: usize) -> String {
    let vertices = frame.color.vertices_camera.iter().map(|p| p / 1000.0);
    vertices.fold(String::new(), |mut text, p| {
        let _ = writeln!(text, "v {:.decimals$} {:.decimals$} {:.decimals$}", p.x, p.y, p.z);
        text
    })
}

#[test]
fn meshes_with_texture_coordinates_are_the_truth_whatever_their_vertices_numbers() {
    let folder = tempfile::tempdir().unwrap();
    write_numbered(folder.path(), 0.0);
    let mesh = RECORDED.0.mesh();
    for (index, frame) in RECORDED.1.iter().enumerate() {
        // Another program's order of the vertices, and its rounding.
        let mut text = vertex_lines(frame, 6)
            .lines()
            .rev()
            .fold(String::new(), |text, line| text + line + "\n");
        for uv in mesh.texture_coordinates().iter().rev() {
            let [u, v] = [uv.x, 1.0 - uv.y].map(|t| 2e-5 + (1.0 - 4e-5) * t);
            let _ = writeln!(text, "vt {u:.5} {v:.5}");
        }
        for face in mesh.faces() {
            let [a, b, c] = face.map(|v| mesh.vertices().len() - v);
            let _ = writeln!(text, "f {a}/{a} {b}/{b} {c}/{c}");
        }
        write(folder.path(), &format!("truth/mesh{}.obj", index + 1), text.as_bytes());
        // 1 on the object, in 16 bits.
        let mask: Vec<u16> = frame.color.truth.mask().into_iter().map(u16::from).collect();
        let mask = encode_depth_png(&mask, &frame.color.camera).unwrap();
        write(folder.path(), &format!("masks/m{:02}_shirt0.png", index + 1), &mask);
    }
    let source = RecordingSource {
        masks: Some(folder.path().join("masks/m*_shirt0.png")),
        ..with_truth(folder.path(), 1000.0)
    };
    import(folder.path(), source).unwrap();
    let recording = Recording::open(&folder.path().join("out")).unwrap();
    assert!(recording.has_masks() && recording.frames() == FRAMES);
    let mask = image::open(folder.path().join("out/mask/000001.png"))
        .unwrap()
        .into_luma8();
    let inside: Vec<bool> = mask.pixels().map(|pixel| pixel.0[0] == 255).collect();
    assert_eq!(inside, RECORDED.1[1].color.truth.mask());
    check_truths(folder.path(), 0.1, 0.0..=0.001, 0.0);
}

#[test]
fn vertices_by_number_are_the_truth_and_what_is_before_them_hides_it() {
    for ending in ["obj", "ply", "csv", "txt"] {
        let folder = tempfile::tempdir().unwrap();
        // A board before all that is not the sheet.
        write_numbered(folder.path(), 300.0);
        for (index, frame) in RECORDED.1.iter().enumerate() {
            let lines = vertex_lines(frame, 7);
            let count = frame.color.vertices_camera.len();
            let text = match ending {
                "obj" => lines,
                "ply" => format!(
                    "ply\nformat ascii 1.0\nelement vertex {count}\nproperty double x\nproperty double y\nproperty double z\nend_header\n{}",
                    lines.replace("v ", "")
                ),
                "csv" => lines.replace("v ", "").replace(' ', ","),
                // What lies right of it is not told.
                _ => lines
                    .lines()
                    .zip(RECORDED.0.mesh().texture_coordinates())
                    .enumerate()
                    .fold("# vertex x y z\n".to_owned(), |text, (vertex, (line, uv))| {
                        match uv.x < 0.81 {
                            true => text + &line.replace("v ", &format!("{vertex}; ")) + "\n",
                            false => text,
                        }
                    }),
            };
            write(folder.path(), &format!("truth/{index}.{ending}"), text.as_bytes());
        }
        let source = RecordingSource {
            pairing: FramePairing::Order,
            ..with_truth(folder.path(), 1000.0)
        };
        import(folder.path(), source).unwrap();
        let missing = if ending == "txt" { 0.1..=0.3 } else { 0.0..=0.0 };
        check_truths(folder.path(), 0.1, missing, 0.0);
    }
}

#[test]
fn registered_points_are_the_truth_where_they_are() {
    // A point for each pixel, or for every 9th along rows and columns: 12 mm on the sheet, more than between its vertices.
    for (step, limit_mm) in [(1, 0.1), (9, 0.2)] {
        let folder = tempfile::tempdir().unwrap();
        for (index, frame) in RECORDED.1.iter().enumerate() {
            let (maps, camera) = (&frame.color.truth, &frame.color.camera);
            let png = deepsft_formats::encode_png(&frame.color.image).unwrap();
            let name = |kind: &str| format!("scene/frame-{index:06}.{kind}.png");
            write(folder.path(), &name("color"), &png);
            write(folder.path(), &name("depth"), &depth_png(frame, 1000.0, 0.0));
            let width = maps.size().width;
            let row = |pixel: usize| {
                let centre = DVec2::new((pixel % width) as f64 + 0.5, (pixel / width) as f64 + 0.5);
                let (uv, p) = (maps.uv(pixel), camera.unproject(centre, f64::from(maps.depth()[pixel])));
                [uv.x, uv.y, p.x, p.y, p.z].map(|number| number as f32)
            };
            let is_taken = |pixel: &usize| {
                maps.inside(*pixel) && (pixel % width).is_multiple_of(step) && (pixel / width).is_multiple_of(step)
            };
            let rows = (0..maps.depth().len()).filter(is_taken).flat_map(row);
            write(
                folder.path(),
                &format!("truth/{index}.npy"),
                &f32_npy(&[5], rows).unwrap(),
            );
        }
        let source = RecordingSource {
            color: folder.path().join("scene/frame-*.color.png"),
            depth: folder.path().join("scene/frame-*.depth.png"),
            ..with_truth(folder.path(), 1.0)
        };
        import(folder.path(), source).unwrap();
        check_truths(folder.path(), limit_mm, 0.0..=0.02, 0.05);
    }
}

#[test]
fn what_is_wrong_with_a_recording_of_others_is_said_and_nothing_is_left() {
    type Damage = fn(&Path, &mut RecordingSource);
    let cases: [(&str, Damage, &[&str]); 16] = [
        (
            "no folder",
            |_, source| source.depth = "nowhere".into(),
            &["depth pictures nowhere", "no such file or folder"],
        ),
        (
            "no pictures",
            |_, source| source.color.push("*.webm"),
            &["colour pictures", "none of them"],
        ),
        (
            "counts",
            |folder, source| {
                fs::remove_file(folder.join("depth/2.png")).unwrap();
                source.pairing = FramePairing::Order;
            },
            &["depth pictures", "it has 2 of them", "color has 3"],
        ),
        (
            "numbers",
            |folder, _| write(folder, "depth/a02.png", b""),
            &["2.png and ", "a02.png have one number"],
        ),
        (
            "partners",
            |folder, _| {
                for number in 1..=FRAMES {
                    let place = |number| folder.join(format!("depth/{number}.png"));
                    fs::rename(place(number), place(number + FRAMES)).unwrap();
                }
            },
            &["none of them has its partners"],
        ),
        (
            "8 bits",
            |folder, source| {
                let grey = encode_mask_png(&vec![true; 960 * 540], &source.sensor.color).unwrap();
                write(folder, "depth/2.png", &grey);
            },
            &["depth picture", "depth/2.png", "16-bit grey, this one is L8"],
        ),
        (
            "size of colour",
            |_, source| {
                source.sensor = RgbdSensor::registered(training_camera());
            },
            &[
                "colour picture",
                "frame_001.jpg",
                "960 x 540 pixels, its camera 480 x 270",
            ],
        ),
        (
            "size of depth",
            |folder, _| {
                let camera = training_camera();
                let small = encode_depth_png(&vec![700; 480 * 270], &camera).unwrap();
                write(folder, "depth/3.png", &small);
            },
            &["depth/3.png", "480 x 270 pixels, its camera 960 x 540"],
        ),
        (
            "cut",
            |folder, _| {
                let bytes = fs::read(folder.join("depth/3.png")).unwrap();
                write(folder, "depth/3.png", &bytes[..bytes.len() / 2]);
            },
            &["depth/3.png"],
        ),
        (
            "vertices",
            |folder, _| write(folder, "truth/1.obj", b"v 0 0 1\nv 0 1 1\nv 1 0 1\n"),
            &["truth/1.obj", "3 vertices, the template"],
        ),
        (
            "line",
            |folder, _| write(folder, "truth/2.txt", b"0 0 1 2 500\n1 a\n"),
            &["truth/2.txt", "line 2 is no row"],
        ),
        (
            "columns",
            |folder, _| write(folder, "truth/2.txt", b"1 2\n3 4\n"),
            &["truth/2.txt", "2 numbers: u v x y z"],
        ),
        (
            "ragged",
            |folder, _| write(folder, "truth/2.txt", b"1 2 3\n3 4\n"),
            &["truth/2.txt", "row 2 has 2 numbers, the first 3"],
        ),
        (
            "few",
            |folder, _| write(folder, "truth/2.txt", b"0 1 2 500\n1 5 6 500"),
            &["truth/2.txt", "it tells 2 of"],
        ),
        (
            "unit",
            |_, source| source.truth.as_mut().unwrap().mm_per_unit = 1.0,
            &["truth/1.", "0.001 times", "unit"],
        ),
        (
            "axes",
            |_, source| source.truth.as_mut().unwrap().mm_per_unit = -1000.0,
            &["truth/1.", "behind the camera"],
        ),
    ];
    for (name, damage, parts) in cases {
        let folder = tempfile::tempdir().unwrap();
        write_numbered(folder.path(), 0.0);
        for (index, frame) in RECORDED.1.iter().enumerate() {
            write(
                folder.path(),
                &format!("truth/{}.xyz", index + 1),
                vertex_lines(frame, 6).replace("v ", "").as_bytes(),
            );
        }
        let mut source = with_truth(folder.path(), 1000.0);
        damage(folder.path(), &mut source);
        for number in 1..=FRAMES {
            let other = ["obj", "txt"]
                .iter()
                .any(|ending| folder.path().join(format!("truth/{number}.{ending}")).exists());
            if other {
                fs::remove_file(folder.path().join(format!("truth/{number}.xyz"))).unwrap();
            }
        }
        let message = import(folder.path(), source).map(drop).unwrap_err().to_string();
        for part in parts {
            assert!(message.contains(part), "{name}: {part:?} is not in: {message}");
        }
        let left = fs::read_dir(folder.path())
            .unwrap()
            .map(|entry| entry.unwrap().file_name());
        let left: Vec<_> = left.filter(|name| name.to_string_lossy().contains("out")).collect();
        assert!(left.is_empty(), "{name}: {left:?}");
    }
}

#[test]
fn an_import_replaces_an_older_one_and_nothing_of_ones_own_and_ends_when_asked_to() {
    let folder = tempfile::tempdir().unwrap();
    write_numbered(folder.path(), 0.0);
    import(folder.path(), numbered(folder.path())).unwrap();
    write(folder.path(), "out/rgb/notes.txt", b"mine");
    let mut asked = 0;
    let again = RecordingImport::open(numbered(folder.path())).unwrap();
    let ended = again.write(&folder.path().join("out"), || {
        asked += 1;
        if asked == 2 {
            Err(SynthError::Refused("enough".to_owned()))
        } else {
            Ok(())
        }
    });
    assert_eq!(ended.unwrap_err().to_string(), "enough");
    assert_eq!(Recording::open(&folder.path().join("out")).unwrap().frames(), FRAMES);
    fs::remove_file(folder.path().join("color/frame_003.jpg")).unwrap();
    let again = import(folder.path(), numbered(folder.path())).unwrap();
    assert_eq!(again.left_out(), [folder.path().join("depth/3.png")]);
    assert_eq!(Recording::open(&folder.path().join("out")).unwrap().frames(), 2);
    assert_eq!(fs::read(folder.path().join("out/rgb/notes.txt")).unwrap(), b"mine");
    let list = fs::read_to_string(folder.path().join("out/imported.csv")).unwrap();
    assert_eq!(
        list,
        "frame,color,depth,others\n000000,frame_001.jpg,1.png\n000001,frame_002.jpg,2.png\n"
    );
    // A recording that is no import is somebody's own.
    fs::remove_file(folder.path().join("out/imported.csv")).unwrap();
    let refused = import(folder.path(), numbered(folder.path())).unwrap_err().to_string();
    assert!(refused.contains("holds no imported.csv"), "{refused}");
}
