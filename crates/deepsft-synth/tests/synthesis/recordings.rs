//! RGB-D recordings: what is written comes back, what is wrong is named, what is simulated agrees with its truth.

use deepsft_formats::encode_jpeg;
use deepsft_geometry::{Camera, Picture, Template, training_camera};
use deepsft_synth::{
    CAMERA_FILE, DEPTH_FOLDER, MASK_FOLDER, RGB_FOLDER, Recording, RecordingSimulator, RgbdSensor, SynthError,
    encode_depth_png, encode_mask_png,
};
use image::ImageEncoder;
use image::codecs::png::PngEncoder;
use std::fs;
use std::path::Path;

fn png(picture: &Picture) -> Vec<u8> {
    let mut coded = Vec::new();
    let (width, height) = (picture.width() as u32, picture.height() as u32);
    PngEncoder::new(&mut coded)
        .write_image(picture.rgb(), width, height, image::ExtendedColorType::Rgb8)
        .unwrap();
    coded
}

fn write(folder: &Path, name: &str, bytes: &[u8]) {
    let path = folder.join(name);
    fs::create_dir_all(path.parent().unwrap()).unwrap();
    fs::write(path, bytes).unwrap();
}

fn small_camera() -> Camera {
    training_camera().resized((48, 27)).unwrap()
}

fn color() -> Picture {
    Picture::from_fn(48, 27, |x, y| [5 * x as u8, 9 * y as u8, 100])
}

fn depth() -> Vec<u16> {
    (0..48 * 27)
        .map(|i| if i % 5 == 0 { 0 } else { 3000 + i as u16 })
        .collect()
}

/// Two frames `a` and `b` of a registered sensor with 5 units a millimetre.
fn write_small(folder: &Path) {
    let sensor = RgbdSensor {
        depth_scale: 5000.0,
        ..RgbdSensor::registered(small_camera())
    };
    write(folder, CAMERA_FILE, sensor.to_json().as_bytes());
    for name in ["a", "b"] {
        write(folder, &format!("rgb/{name}.png"), &png(&color()));
        let depth = encode_depth_png(&depth(), &small_camera()).unwrap();
        write(folder, &format!("depth/{name}.png"), &depth);
    }
}

fn refusal(folder: &Path) -> String {
    let frames = |recording: Recording| -> Result<(), SynthError> {
        for index in 0..recording.frames() {
            recording.frame(index, &small_camera())?;
        }
        Ok(())
    };
    Recording::open(folder).and_then(frames).unwrap_err().to_string()
}

#[test]
fn a_registered_recording_comes_back_as_it_was_written() {
    let folder = tempfile::tempdir().unwrap();
    write_small(folder.path());
    let recording = Recording::open(folder.path()).unwrap();
    assert_eq!((recording.frames(), recording.has_masks()), (2, false));
    let frame = recording.frame(1, &small_camera()).unwrap();
    assert_eq!(frame.image, color());
    assert_eq!(frame.mask, None);
    for (mm, units) in frame.depth_mm.iter().zip(depth()) {
        assert!((f64::from(*mm) - f64::from(units) / 5.0).abs() < 1e-4);
    }
    let mask: Vec<bool> = (0..48 * 27).map(|i| i % 48 > 20).collect();
    for name in ["a", "b"] {
        let bytes = encode_mask_png(&mask, &small_camera()).unwrap();
        write(folder.path(), &format!("{MASK_FOLDER}/{name}.png"), &bytes);
    }
    let recording = Recording::open(folder.path()).unwrap();
    assert_eq!(recording.frame(0, &small_camera()).unwrap().mask, Some(mask));
}

#[test]
fn associations_pair_other_names_and_set_the_order() {
    let folder = tempfile::tempdir().unwrap();
    write_small(folder.path());
    let jpeg = encode_jpeg(&Picture::from_fn(48, 27, |_, _| [200; 3]), 95).unwrap();
    write(folder.path(), "rgb/17.25.jpg", &jpeg);
    let list = "# time rgb time depth\n17.25 rgb/17.25.jpg 17.26 depth/b.png\n\n18.1 depth/a.png 18.0 rgb/a.png\n";
    write(folder.path(), "associations.txt", list.as_bytes());
    let recording = Recording::open(folder.path()).unwrap();
    assert_eq!(recording.frames(), 2);
    let first = recording.frame(0, &small_camera()).unwrap();
    assert!(first.image.rgb().iter().all(|&c| c.abs_diff(200) < 4));
    assert_eq!(recording.frame(1, &small_camera()).unwrap().image, color());
    write(folder.path(), "associations.txt", b"1 rgb/none.png 1 depth/a.png\n");
    let message = refusal(folder.path());
    assert!(
        message.contains("no such picture") && message.contains("none.png"),
        "{message}"
    );
    for (line, part) in [
        ("1.0 rgb/a.png 1.1", "line 1 is not"),
        ("1.0 rgb/a.png 1.1 rgb/b.png", "does not name one picture in depth/"),
        ("1.0 rgb/a.png 1.1 ../depth/b.png", "outside"),
        ("1.0 rgb/a.png 1.1 /depth/b.png", "outside"),
    ] {
        write(folder.path(), "associations.txt", line.as_bytes());
        assert!(refusal(folder.path()).contains(part), "{line}");
    }
}

#[test]
fn what_is_wrong_with_a_recording_is_said_with_the_name_of_the_file() {
    type Damage = fn(&Path);
    let cases: [(Damage, &[&str]); 8] = [
        (
            |folder| fs::remove_file(folder.join("depth/b.png")).unwrap(),
            &["no partner depth/b.png", "rgb/b.png"],
        ),
        (
            |folder| fs::remove_file(folder.join("rgb/a.png")).unwrap(),
            &["no partner rgb/a.png", "depth/a.png"],
        ),
        (
            |folder| write(folder, "rgb/b.png", &png(&Picture::from_fn(40, 27, |_, _| [0; 3]))),
            &["40 x 27 pixels, its camera 48 x 27", "b.png"],
        ),
        (
            |folder| {
                let mut coded = Vec::new();
                PngEncoder::new(&mut coded)
                    .write_image(&[7; 48 * 27], 48, 27, image::ExtendedColorType::L8)
                    .unwrap();
                write(folder, "depth/a.png", &coded);
            },
            &["16-bit grey, this one is L8", "a.png"],
        ),
        (
            |folder| {
                let bytes = fs::read(folder.join("depth/a.png")).unwrap();
                fs::write(folder.join("depth/a.png"), &bytes[..bytes.len() / 2]).unwrap();
            },
            &["a.png"],
        ),
        (
            |folder| fs::remove_file(folder.join(CAMERA_FILE)).unwrap(),
            &["camera.json"],
        ),
        (
            |folder| {
                for name in ["a", "b"] {
                    fs::remove_file(folder.join(RGB_FOLDER).join(format!("{name}.png"))).unwrap();
                    fs::remove_file(folder.join(DEPTH_FOLDER).join(format!("{name}.png"))).unwrap();
                }
            },
            &["no pictures in it", "rgb"],
        ),
        (
            |folder| {
                let mask = encode_mask_png(&[true; 48 * 27], &small_camera()).unwrap();
                write(folder, "mask/a.png", &mask);
            },
            &["no such mask for rgb/b.png", "mask/b.png"],
        ),
    ];
    for (damage, parts) in cases {
        let folder = tempfile::tempdir().unwrap();
        write_small(folder.path());
        damage(folder.path());
        let message = refusal(folder.path());
        for part in parts {
            assert!(message.contains(part), "{part:?} is not in: {message}");
        }
    }
}

fn template() -> Template {
    let texture = Picture::from_fn(90, 60, |x, y| {
        [(x * 7 % 256) as u8, (y * 11 % 256) as u8, (x * y) as u8]
    });
    Template::thin_shell(texture, 297.0, 210.0).unwrap()
}

fn simulator_of(seed: u64) -> RecordingSimulator {
    RecordingSimulator::new(&template(), false, seed).unwrap()
}

#[test]
fn a_simulated_recording_aligned_and_read_back_measures_its_truth_up_to_the_sensors_noise() {
    let folder = tempfile::tempdir().unwrap();
    let simulator = simulator_of(3);
    let sensor = simulator.sensor();
    assert!(sensor.simulated && !sensor.is_registered());
    let frame = simulator.take(1).frame(2).unwrap();
    write(folder.path(), CAMERA_FILE, sensor.to_json().as_bytes());
    write(folder.path(), "rgb/0.png", &png(&frame.color.image));
    let depth = encode_depth_png(&frame.depth, &sensor.depth).unwrap();
    write(folder.path(), "depth/0.png", &depth);
    let recording = Recording::open(folder.path()).unwrap();
    assert!(recording.sensor().simulated);
    let read = recording.frame(0, &training_camera()).unwrap();
    assert_eq!(read.image, frame.truth.image);

    let truth = &frame.truth.truth;
    let pixels = |of: &dyn Fn(usize) -> bool| (0..480 * 270).filter(|&p| of(p)).count();
    let area = truth.area();
    let measured = pixels(&|p| truth.inside(p) && read.depth_mm[p] > 0.0);
    assert!(measured > 85 * area / 100, "{measured} of {area} pixels");
    // The noise at 560 to 820 mm is 1.3 mm, and less where depth pixels are averaged; a square that is a pixel off on a
    // tilted sheet adds as much. Two cameras that were put together wrongly differ by tens.
    let close = pixels(&|p| truth.inside(p) && (read.depth_mm[p] - truth.depth()[p]).abs() < 5.0);
    assert!(close > 90 * measured / 100, "{close} of {measured} pixels");
    let bias: f64 = (0..480 * 270)
        .filter(|&p| truth.inside(p) && (read.depth_mm[p] - truth.depth()[p]).abs() < 20.0)
        .map(|p| f64::from(read.depth_mm[p] - truth.depth()[p]))
        .sum::<f64>()
        / measured as f64;
    assert!(bias.abs() < 0.7, "{bias}");
}

#[test]
fn a_simulated_recording_is_made_in_one_place_unless_it_is_asked_to_change() {
    let takes = |conditions_change| {
        let simulator = RecordingSimulator::new(&template(), conditions_change, 3).unwrap();
        [0, 1].map(|number| simulator.take(number).frame(0).unwrap().truth)
    };
    let (one, several) = (takes(false), takes(true));
    assert_eq!(one[0].towards_light, one[1].towards_light);
    assert!(several[0].towards_light != several[1].towards_light);
    // Where sheets and hands do not reach, the background is another one.
    assert!(one[0].image.pixel(2, 2) != one[1].image.pixel(2, 2));
    // The first take is the same in both.
    assert!(one[0] == several[0] && one[1].vertices_camera == several[1].vertices_camera);
}

#[test]
fn a_simulated_recording_is_a_function_of_its_seed_and_moves_smoothly_within_a_take() {
    let simulator = simulator_of(3);
    let take = simulator.take(0);
    let frames: Vec<_> = (0..3).map(|k| take.frame(k).unwrap()).collect();
    assert!(simulator_of(3).take(0).frame(1).unwrap() == frames[1]);
    assert!(simulator_of(4).take(0).frame(1).unwrap().color.image != frames[1].color.image);
    let way = |a: &[deepsft_geometry::glam::DVec3], b: &[deepsft_geometry::glam::DVec3]| {
        a.iter().zip(b).map(|(a, b)| a.distance(*b)).fold(0.0, f64::max)
    };
    for pair in frames.windows(2) {
        // A hand in no hurry moves at up to 0.7 m/s: 140 mm in a fifth of a second.
        let step = way(&pair[0].color.vertices_camera, &pair[1].color.vertices_camera);
        assert!(step > 0.1 && step < 140.0, "{step}");
    }
    let other = simulator.take(1).frame(0).unwrap();
    assert!(way(&frames[0].color.vertices_camera, &other.color.vertices_camera) > 20.0);
    // The print has its own size: along its upper edge, measured from vertex to vertex.
    let scale = simulator.print().scale;
    assert!((scale - 1.0).abs() > 0.006, "{scale}: too near 1 to tell");
    let (columns, _) = template().grid().unwrap();
    let edge: f64 = other.color.vertices_camera[..columns]
        .windows(2)
        .map(|pair| pair[0].distance(pair[1]))
        .sum();
    // Chords of a bend are a little shorter than the sheet.
    assert!((edge / (297.0 * scale) - 1.0).abs() < 0.005, "{edge}");
}
