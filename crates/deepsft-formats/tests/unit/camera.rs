//! `camera.json`.

use deepsft_formats::{camera_from_json, camera_to_json};
use deepsft_geometry::Lens;

const GOOD: &str = r#"{"width": 640, "height": 480, "fx": 528.25, "fy": 527.5, "cx": 320.5, "cy": 239.75,
    "distortion": [0.1, -0.2, 0.001, 0.002, 0.3], "depth_scale": 1000}"#;

fn message(json: &str) -> String {
    camera_from_json(json.as_bytes()).unwrap_err().to_string()
}

#[test]
fn a_camera_comes_back_as_it_was() {
    let camera = camera_from_json(GOOD.as_bytes()).unwrap();
    assert_eq!(camera.lens(), Lens::Polynomial([0.1, -0.2, 0.001, 0.002, 0.3]));
    assert_eq!(camera_from_json(camera_to_json(&camera).as_bytes()).unwrap(), camera);
    let plain = camera.with_distortion([0.0; 5]).unwrap();
    assert!(!camera_to_json(&plain).contains("distortion"));
    assert_eq!(camera_from_json(camera_to_json(&plain).as_bytes()).unwrap(), plain);
}

#[test]
fn a_fisheye_comes_back_as_it_was_and_is_not_also_a_polynomial() {
    let json = GOOD.replace(
        "\"distortion\": [0.1, -0.2, 0.001, 0.002, 0.3]",
        "\"fisheye\": [0.0, -0.02, 0.003, 0.0]",
    );
    let camera = camera_from_json(json.as_bytes()).unwrap();
    assert_eq!(camera.lens(), Lens::Fisheye([0.0, -0.02, 0.003, 0.0]));
    let written = camera_to_json(&camera);
    assert!(!written.contains("distortion"), "{written}");
    assert_eq!(camera_from_json(written.as_bytes()).unwrap(), camera);
    assert!(
        message(&json.replace("\"depth_scale\"", "\"distortion\": [0, 0, 0, 0, 0], \"depth_scale\""))
            .contains("of which a lens has one")
    );
    assert!(message(&json.replace("0.003, 0.0]", "0.003]")).contains("length 3"));
}

#[test]
fn pixel_centres_at_integers_move_the_principal_point_by_half_a_pixel() {
    // What cv2.calibrateCamera gives of an ideal camera of 640 x 480: the middle of the image is (319.5, 239.5).
    let opencv = r#"{"width": 640, "height": 480, "fx": 525, "fy": 525, "cx": 319.5, "cy": 239.5"#;
    let principal = |more: &str| camera_from_json(format!("{opencv}{more}}}").as_bytes()).map(|c| c.principal_point());
    let middle = principal(r#", "pixel_centers": "integer""#).unwrap();
    assert_eq!(middle.to_array(), [320.0, 240.0]);
    for ours in ["", r#", "pixel_centers": "half""#] {
        assert_eq!(principal(ours).unwrap().to_array(), [319.5, 239.5]);
    }
    let unknown = principal(r#", "pixel_centers": "corner""#).unwrap_err().to_string();
    assert!(unknown.contains("corner") && unknown.contains("integer"), "{unknown}");
}

#[test]
fn a_focal_length_of_zero_is_named() {
    assert!(message(&GOOD.replace("528.25", "0")).contains("fx is 0"));
}

#[test]
fn a_number_that_is_no_number_is_refused_with_its_place() {
    for bad in ["NaN", "1e999", "\"528\"", "null"] {
        let message = message(&GOOD.replace("528.25", bad));
        assert!(message.contains("line 1 column"), "{bad}: {message}");
    }
}

#[test]
fn a_missing_field_and_a_truncated_file_are_refused() {
    assert!(message(&GOOD.replace("\"cy\"", "\"cz\"")).contains("missing field `cy`"));
    assert!(message(&GOOD[..40]).contains("EOF"));
    assert!(message("").contains("EOF"));
    assert!(message(&GOOD.replace("640", "-640")).contains("-640"));
}
