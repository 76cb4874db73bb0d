//! The cameras of an RGB-D recording and their file.

use crate::RgbdSensor;
use deepsft_geometry::Camera;
use deepsft_geometry::glam::{DAffine3, DQuat, DVec2, DVec3};

const TUM: &str = r#"{"width": 640, "height": 480, "fx": 525, "fy": 525, "cx": 319.5, "cy": 239.5,
    "pixel_centers": "integer", "depth_scale": 5000}"#;

#[test]
fn a_registered_recording_needs_only_the_colour_camera() {
    let sensor = RgbdSensor::from_json(TUM).unwrap();
    assert!(sensor.is_registered() && !sensor.simulated);
    assert_eq!((sensor.depth_scale, sensor.depth.size().width), (5000.0, 640));
    // TUM's default intrinsics are those of an ideal camera: (319.5, 239.5) is the middle of its image.
    assert_eq!(sensor.color.principal_point().to_array(), [320.0, 240.0]);
    assert_eq!(sensor.depth.principal_point(), sensor.color.principal_point());
    assert_eq!(RgbdSensor::from_json(&sensor.to_json()).unwrap(), sensor);
}

#[test]
fn the_depth_camera_counts_pixels_as_the_colour_camera_unless_it_says_otherwise() {
    let depth = |more: &str| {
        let camera = format!(
            "\"depth_camera\": {{\"width\": 5, \"height\": 4, \"fx\": 3, \"fy\": 3, \"cx\": 2, \"cy\": 1.5{more}}}"
        );
        let json = TUM.replace("\"depth_scale\": 5000", &camera);
        RgbdSensor::from_json(&json).unwrap().depth.principal_point().to_array()
    };
    assert_eq!(depth(""), [2.5, 2.0]);
    assert_eq!(depth(", \"pixel_centers\": \"half\""), [2.0, 1.5]);
}

#[test]
fn a_sensor_of_two_cameras_comes_back_as_it_was() {
    let sensor = RgbdSensor {
        depth: Camera::pinhole((512, 424), DVec2::new(365.0, 365.5), DVec2::new(256.2, 210.1)).unwrap(),
        color_from_depth: DAffine3::from_rotation_translation(
            DQuat::from_rotation_y(0.01),
            DVec3::new(52.0, 0.5, -1.0),
        ),
        simulated: true,
        ..RgbdSensor::registered(Camera::typical((960, 540)).unwrap())
    };
    let read = RgbdSensor::from_json(&sensor.to_json()).unwrap();
    // Numbers go through decimals: the pose is as it was but for rounding.
    assert!(read.color_from_depth.abs_diff_eq(sensor.color_from_depth, 1e-12));
    let color_from_depth = sensor.color_from_depth;
    assert_eq!(
        RgbdSensor {
            color_from_depth,
            ..read
        },
        sensor
    );
}

#[test]
fn what_is_wrong_is_named() {
    let with = |more: &str| {
        RgbdSensor::from_json(&TUM.replace("\"depth_scale\": 5000", more))
            .unwrap_err()
            .to_string()
    };
    assert!(with("\"depth_scale\": 0").contains("depth_scale is 0"));
    assert!(with("\"color_from_depth\": [[1,0,0,0],[0,1,0,0],[0,0,1,0]]").contains("intrinsics"));
    let camera = r#""depth_camera": {"width": 5, "height": 4, "fx": 3, "fy": 3, "cx": 2, "cy": 2}"#;
    let stretched = format!("{camera}, \"color_from_depth\": [[2,0,0,0],[0,1,0,0],[0,0,1,0]]");
    assert!(with(&stretched).contains("not a rotation"));
    let mirrored = format!("{camera}, \"color_from_depth\": [[-1,0,0,0],[0,1,0,0],[0,0,1,0]]");
    assert!(with(&mirrored).contains("not a rotation"));
    assert!(with(&camera.replace("\"fx\": 3", "\"fx\": 0")).contains("depth_camera: camera fx is 0"));
}
