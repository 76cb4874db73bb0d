//! Cameras of other programs.

use deepsft_formats::camera_from_foreign;
use deepsft_geometry::Camera;
use deepsft_geometry::glam::{DVec2, DVec3};

const ROS: &str = "image_width: 1280
image_height: 720
camera_name: head
camera_matrix:
  rows: 3
  cols: 3
  data: [1010.0, 0.0, 639.5, 0.0, 1008.0, 359.5, 0.0, 0.0, 1.0]
distortion_model: plumb_bob
distortion_coefficients:
  rows: 1
  cols: 5
  data: [0.1, -0.05, 0.001, -0.002, 0.01]
rectification_matrix:
  rows: 3
  cols: 3
  data: [1, 0, 0, 0, 1, 0, 0, 0, 1]
projection_matrix:
  rows: 3
  cols: 4
  data: [990.0, 0.0, 640.0, 0, 0, 990.0, 360.0, 0, 0, 0, 1, 0]
";
const OPENCV_YAML: &str = "%YAML:1.0
---
calibration_time: \"Thu Nov 26\"
image_width: 1280
image_height: 720
board_width: 9
square_size: 25.
camera_matrix: !!opencv-matrix
   rows: 3
   cols: 3
   dt: d
   data: [ 1.0100e+03, 0., 639.5, 0.,
       1008., 359.5, 0., 0., 1. ]
distortion_coefficients: !!opencv-matrix
   rows: 5
   cols: 1
   dt: d
   data: [ 0.1, -0.05, 0.001, -0.002, 0.01 ]
";
const OPENCV_XML: &str = r#"<?xml version="1.0"?>
<opencv_storage>
<image_Width>1280</image_Width>
<image_Height>720</image_Height>
<Camera_Matrix type_id="opencv-matrix">
  <rows>3</rows><cols>3</cols><dt>d</dt>
  <data>1010. 0. 639.5 0. 1008. 359.5 0. 0. 1.</data></Camera_Matrix>
<Distortion_Coefficients type_id="opencv-matrix">
  <rows>5</rows><cols>1</cols><dt>d</dt>
  <data>0.1 -0.05 0.001 -0.002 0.01</data></Distortion_Coefficients>
</opencv_storage>"#;
const OPENCV_JSON: &str = r#"{"image_width": 1280, "image_height": 720,
"camera_matrix": {"type_id": "opencv-matrix", "rows": 3, "cols": 3, "dt": "d", "data": [1010.0, 0.0, 639.5, 0.0, 1008.0, 359.5, 0.0, 0.0, 1.0]},
"dist_coeffs": [[0.1, -0.05, 0.001, -0.002, 0.01]]}"#;
const KALIBR: &str = "cam0:
  cam_overlaps: [1]
  camera_model: pinhole
  distortion_coeffs: [0.1, -0.05, 0.001, -0.002]
  distortion_model: radtan
  intrinsics: [1010.0, 1008.0, 639.5, 359.5]
  resolution: [1280, 720]
  rostopic: /cam0/image_raw
cam1:
  intrinsics: [1.0, 1.0, 1.0, 1.0]
";
const ORB_SLAM: &str = "%YAML:1.0
Camera.type: \"PinHole\"
Camera.fx: 1010.0
Camera.fy: 1008.0
Camera.cx: 639.5
Camera.cy: 359.5
Camera.k1: 0.1
Camera.k2: -0.05
Camera.p1: 0.001
Camera.p2: -0.002
Camera.k3: 0.01
Camera.width: 1280
Camera.height: 720
";
const OPEN3D: &str =
    r#"{"width": 1280, "height": 720, "intrinsic_matrix": [1010.0, 0, 0, 0, 1008.0, 0, 639.5, 359.5, 1]}"#;
const REALSENSE: &str = r#"{"width": 1280, "height": 720, "fx": 1010.0, "fy": 1008.0, "ppx": 639.5, "ppy": 359.5,
"model": "distortion.inverse_brown_conrady", "coeffs": [0.0, 0.0, 0.0, 0.0, 0.0]}"#;
const ARKIT: &str =
    r#"{"imageResolution": [1280, 720], "intrinsics": [[1010.0, 0, 0], [0, 1008.0, 0], [639.5, 359.5, 1]]}"#;

fn camera(lens: [f64; 5]) -> Camera {
    let pinhole = Camera::pinhole((1280, 720), DVec2::new(1010.0, 1008.0), DVec2::new(640.0, 360.0)).unwrap();
    pinhole.with_distortion(lens).unwrap()
}

fn read(text: &str) -> Camera {
    camera_from_foreign(text.as_bytes()).unwrap_or_else(|error| panic!("{text}\n{error}"))
}

fn refused(text: &str) -> String {
    camera_from_foreign(text.as_bytes()).unwrap_err().to_string()
}

#[test]
fn each_program_s_file_is_the_same_camera() {
    let whole = camera([0.1, -0.05, 0.001, -0.002, 0.01]);
    for text in [ROS, OPENCV_YAML, OPENCV_XML, OPENCV_JSON, ORB_SLAM] {
        assert_eq!(read(text), whole, "{text}");
        // As editors of Windows save it.
        assert_eq!(
            read(&format!("\u{feff}{}", text.replace('\n', "\r\n"))),
            whole,
            "{text}"
        );
    }
    assert_eq!(read(KALIBR), camera([0.1, -0.05, 0.001, -0.002, 0.0]));
    for text in [OPEN3D, REALSENSE, ARKIT] {
        assert_eq!(read(text), camera([0.0; 5]), "{text}");
    }
    // A message of ROS 2, and what it looks like when it is recorded.
    let message = "header: {frame_id: head}\nheight: 720\nwidth: 1280\ndistortion_model: plumb_bob\nd: [0.1, -0.05, 0.001, -0.002, 0.01]\n\
                   k: [1010.0, 0, 639.5, 0, 1008.0, 359.5, 0, 0, 1]\n---\nheight: 1\n";
    assert_eq!(read(message), whole);
}

#[test]
fn colmap_has_our_pixel_centres_and_its_own_models() {
    let line = |model: &str| read(&format!("# Camera list\n#   CAMERA_ID, MODEL, WIDTH\n\n1 {model}\n"));
    assert_eq!(line("PINHOLE 1280 720 1010 1008 640 360"), camera([0.0; 5]));
    assert_eq!(
        line("OPENCV 1280 720 1010 1008 640 360 0.1 -0.05 0.001 -0.002"),
        camera([0.1, -0.05, 0.001, -0.002, 0.0])
    );
    let radial = line("SIMPLE_RADIAL 1280 720 1010 640 360 0.1");
    assert_eq!(
        (radial.focal().y, radial.project(DVec3::Z).unwrap()),
        (1010.0, DVec2::new(640.0, 360.0))
    );
    let fisheye = line("OPENCV_FISHEYE 1280 720 1010 1008 640 360 0.1 0.01 0 0");
    let ours = camera([0.0; 5]).with_fisheye([0.1, 0.01, 0.0, 0.0]).unwrap();
    assert_eq!(fisheye, ours);
    let equidistant = KALIBR
        .replace("radtan", "equidistant")
        .replace("[0.1, -0.05, 0.001, -0.002]", "[0.1, 0.01, 0, 0]");
    assert_eq!(read(&equidistant), ours);
    let model = refused("1 FOV 1280 720 1010 1008 640 360 0.9");
    assert!(model.contains("FOV") && model.contains("OPENCV"), "{model}");
    let two = "1 PINHOLE 4 3 2 2 2 2\n2 PINHOLE 4 3 2 2 2 2\n";
    assert!(refused(two).contains("several cameras"));
}

#[test]
fn a_rational_lens_is_followed_to_half_a_pixel_or_refused() {
    // As an Azure Kinect's colour camera in OpenCV, with more tangential distortion.
    let lens = [0.45, -2.65, 0.02, -0.015, 1.5, 0.33, -2.47, 1.43];
    let text = |lens: &[f64]| ROS.replace("[0.1, -0.05, 0.001, -0.002, 0.01]", &format!("{lens:?}"));
    let camera = read(&text(&lens));
    let mut farthest = 0.0_f64;
    for x in -6..=6 {
        for y in -3..=3 {
            let ray = DVec2::new(f64::from(x), f64::from(y)) * 0.1;
            let [k1, k2, p1, p2, k3, k4, k5, k6] = lens;
            let r2 = ray.length_squared();
            let radial = (1.0 + k1 * r2 + k2 * r2.powi(2) + k3 * r2.powi(3))
                / (1.0 + k4 * r2 + k5 * r2.powi(2) + k6 * r2.powi(3));
            let shift = DVec2::new(
                2.0 * p1 * ray.x * ray.y + p2 * (r2 + 2.0 * ray.x * ray.x),
                p1 * (r2 + 2.0 * ray.y * ray.y) + 2.0 * p2 * ray.x * ray.y,
            );
            let expected = (ray * radial + shift) * DVec2::new(1010.0, 1008.0) + DVec2::new(640.0, 360.0);
            farthest = farthest.max(camera.project(ray.extend(1.0)).unwrap().distance(expected));
        }
    }
    assert!(farthest < 0.5, "{farthest} px");
    // Without the later coefficients it is off by pixels.
    let ray = DVec3::new(0.6, 0.3, 1.0);
    let first = self::camera([0.45, -2.65, 0.02, -0.015, 1.5]).project(ray);
    assert!(first.is_none_or(|first| first.distance(camera.project(ray).unwrap()) > 5.0));
    let zeros = [0.1, -0.05, 0.001, -0.002, 0.01, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0];
    assert_eq!(read(&text(&zeros)), self::camera([0.1, -0.05, 0.001, -0.002, 0.01]));
    let wild = refused(&text(&[0.0, 0.0, 0.0, 0.0, 0.0, 40.0, -300.0, 900.0]));
    assert!(wild.contains("half a pixel"), "{wild}");
    for count in [1, 6, 7, 13, 20] {
        let number = refused(&text(&vec![0.01; count]));
        assert!(number.contains("4, 5, 8, 12 or 14"), "{number}");
    }
    let tilted = refused(&text(&[[0.0; 12].as_slice(), &[0.01, 0.0]].concat()));
    assert!(tilted.contains("tilted sensor"), "{tilted}");
}

#[test]
fn what_is_missing_or_unknown_is_said() {
    let no_size = ROS.replace("image_width: 1280\nimage_height: 720\n", "");
    assert!(refused(&no_size).contains("image_width"));
    assert!(refused("hello: [1, 2]").contains("camera matrix"));
    let omni = KALIBR.replace("camera_model: pinhole", "camera_model: omni");
    assert!(refused(&omni).contains("omni"));
    // Their models have other numbers of intrinsics.
    for more in ["1.2", "0.1, 0.5"] {
        let longer = omni.replace("intrinsics: [1010.0,", &format!("intrinsics: [{more}, 1010.0,"));
        assert!(refused(&longer).contains("lens model"), "{}", refused(&longer));
    }
    assert!(refused("1 OPENCV 960 540 760 760 480").contains("export OPENCV (8 numbers)"));
    assert!(refused("1 PINHOLE 960 540 760 many 480 270").contains("\"many\""));
    assert!(refused("k: [1, 0, 1, 0, 1, 1, 0, 0]\nw: 4\nh: 3\n").contains("8 numbers"));
    assert!(refused("\0\0").contains("no text"));
    assert!(!refused("a:\n\tb: [").contains('\n'), "a sentence has one line");
    let inverse = REALSENSE.replace("[0.0, ", "[0.1, ");
    assert!(refused(&inverse).contains("inverse"));
    assert!(!refused("<a><b></a>").is_empty());
    let deep = format!("{}1{}", "<a>".repeat(500), "</a>".repeat(500));
    assert!(refused(&deep).contains("camera matrix"));
    for text in [
        "",
        "%YAML:1.0",
        "---",
        "[",
        "{",
        "k: [.nan, 0, 1, 0, 1, 1, 0, 0, 1]\nw: 4\nh: 3\n",
        "w: -4\nh: 3\nk: [1, 1, 1, 1]",
    ] {
        refused(text);
    }
}
