//! `camera.json`: a camera's intrinsics as a file.

use crate::DeepSftError;
use deepsft_geometry::Camera;
use serde::{Deserialize, Serialize};

/// The file's fields. Unknown ones are passed over: recordings keep more about their sensors there.
#[derive(Deserialize, Serialize)]
struct CameraFile {
    width: u32,
    height: u32,
    fx: f64,
    fy: f64,
    cx: f64,
    cy: f64,
    #[serde(default, skip_serializing_if = "is_undistorted")]
    distortion: [f64; 5],
}

fn is_undistorted(distortion: &[f64; 5]) -> bool {
    *distortion == [0.0; 5]
}

/// Reads the content of a `camera.json`: `width`, `height`, `fx`, `fy`, `cx`, `cy` in pixels (the image's corner
/// at (0, 0)) and, if the lens distorts, `distortion` in OpenCV's order (k1, k2, p1, p2, k3).
///
/// ```
/// let json = br#"{"width": 1280, "height": 720, "fx": 1010.5, "fy": 1008.0, "cx": 640.2, "cy": 359.1}"#;
/// let camera = deepsft::parse_camera(json)?;
/// assert_eq!(camera.focal().x, 1010.5);
/// # Ok::<(), deepsft::DeepSftError>(())
/// ```
///
/// # Errors
/// [`DeepSftError::CameraFile`] when it is not JSON or lacks a field (NaN is not JSON),
/// [`DeepSftError::Geometry`] when a value is none a camera can have.
pub fn parse_camera(json: &[u8]) -> Result<Camera, DeepSftError> {
    let file: CameraFile = serde_json::from_slice(json).map_err(|error| DeepSftError::CameraFile {
        reason: error.to_string(),
    })?;
    let camera = Camera::pinhole(file.width, file.height, file.fx, file.fy, file.cx, file.cy)?;
    Ok(camera.with_distortion(file.distortion)?)
}

/// The content of a `camera.json` that [`parse_camera`] reads as `camera`; `distortion` is left out for
/// a lens without.
pub fn camera_to_json(camera: &Camera) -> String {
    let (focal, principal) = (camera.focal(), camera.principal_point());
    let file = CameraFile {
        width: camera.width(),
        height: camera.height(),
        fx: focal.x,
        fy: focal.y,
        cx: principal.x,
        cy: principal.y,
        distortion: camera.distortion(),
    };
    // Numbers and fixed keys: there is nothing in it that JSON could not say.
    serde_json::to_string_pretty(&file).unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;

    const GOOD: &str = r#"{"width": 640, "height": 480, "fx": 528.25, "fy": 527.5, "cx": 320.5, "cy": 239.75,
        "distortion": [0.1, -0.2, 0.001, 0.002, 0.3], "depth_scale": 1000}"#;

    fn message(json: &str) -> String {
        parse_camera(json.as_bytes()).unwrap_err().to_string()
    }

    #[test]
    fn a_camera_comes_back_as_it_was() {
        let camera = parse_camera(GOOD.as_bytes()).unwrap();
        assert_eq!(camera.distortion()[4], 0.3);
        assert_eq!(parse_camera(camera_to_json(&camera).as_bytes()).unwrap(), camera);
        let plain = camera.with_distortion([0.0; 5]).unwrap();
        assert!(!camera_to_json(&plain).contains("distortion"));
        assert_eq!(parse_camera(camera_to_json(&plain).as_bytes()).unwrap(), plain);
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
}
