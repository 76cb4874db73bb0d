//! `camera.json`: a camera's intrinsics as a file.

use crate::error::FormatError;
use crate::reasons::json_reason;
use deepsft_geometry::glam::DVec2;
use deepsft_geometry::{Camera, Lens};
use serde::{Deserialize, Serialize};

/// Name of the file with the camera in a folder of frames, a clip or a recording.
pub const CAMERA_FILE: &str = "camera.json";

/// The fields of a `camera.json`. Unknown ones are passed over: recordings keep more about their sensors there.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
pub struct CameraFile {
    width: usize,
    height: usize,
    fx: f64,
    fy: f64,
    cx: f64,
    cy: f64,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pixel_centers: Option<PixelCenters>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    distortion: Option<Vec<f64>>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    fisheye: Option<[f64; 4]>,
}

/// Where a file's `cx` and `cy` have the centres of pixels.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, Serialize)]
#[serde(rename_all = "lowercase")]
enum PixelCenters {
    /// At 0.5, 1.5, ...: the image's corner is (0, 0) and its middle (width / 2, height / 2). So are our cameras.
    #[default]
    Half,
    /// At 0, 1, ...: the centre of the first pixel is (0, 0), as in OpenCV, ROS and the TUM data sets. Reading adds half
    /// a pixel to `cx` and `cy`.
    Integer,
}

impl CameraFile {
    /// The fields of `camera`.
    pub fn new(camera: &Camera) -> Self {
        let (focal, principal) = (camera.focal(), camera.principal_point());
        let (distortion, fisheye) = match camera.lens() {
            Lens::Pinhole => (Some(vec![0.0; 5]), None),
            Lens::Polynomial(coefficients) => (Some(coefficients.to_vec()), None),
            Lens::Fisheye(coefficients) => (None, Some(coefficients)),
        };
        Self {
            width: camera.size().width,
            height: camera.size().height,
            fx: focal.x,
            fy: focal.y,
            cx: principal.x,
            cy: principal.y,
            pixel_centers: None,
            distortion,
            fisheye,
        }
    }

    /// The same, with the pixel centres of `other` where it names none: one convention for all cameras of a file.
    #[must_use]
    pub fn or_centers_of(mut self, other: &Self) -> Self {
        self.pixel_centers = self.pixel_centers.or(other.pixel_centers);
        self
    }

    /// The camera of these fields.
    ///
    /// # Errors
    /// [`FormatError::Geometry`] when a value is none a camera can have, [`FormatError::CameraFile`] for two lenses.
    pub fn camera(&self) -> Result<Camera, FormatError> {
        let corner = match self.pixel_centers.unwrap_or_default() {
            PixelCenters::Half => 0.0,
            PixelCenters::Integer => 0.5,
        };
        let (focal, centre) = (DVec2::new(self.fx, self.fy), DVec2::new(self.cx, self.cy) + corner);
        let camera = Camera::pinhole((self.width, self.height), focal, centre)?;
        match (&self.distortion, self.fisheye) {
            (Some(_), Some(_)) => Err(FormatError::CameraFile(
                "it has distortion and fisheye, of which a lens has one: remove the other".to_owned(),
            )),
            (None, Some(coefficients)) => Ok(camera.with_fisheye(coefficients)?),
            (coefficients, None) => Ok(camera.with_opencv_distortion(coefficients.as_deref().unwrap_or_default())?),
        }
    }
}

/// Reads the content of a `camera.json`: `width`, `height`, `fx`, `fy`, `cx`, `cy` in pixels and, if the lens distorts,
/// `distortion` in OpenCV's order (k1, k2, p1, p2, k3, or 4, 8, 12 or 14 numbers) or `fisheye` with the (k1, k2, k3, k4) of `cv::fisheye`. The image's
/// corner is (0, 0) and the centre of the first pixel (0.5, 0.5) unless the file says `"pixel_centers": "integer"`, as
/// calibrations by OpenCV need: then half a pixel is added to `cx` and `cy`.
///
/// ```
/// let json = br#"{"width": 1280, "height": 720, "fx": 1010.5, "fy": 1008.0, "cx": 639.7, "cy": 358.6,
///     "pixel_centers": "integer"}"#;
/// let camera = deepsft_formats::camera_from_json(json)?;
/// assert_eq!((camera.focal().x, camera.principal_point().x), (1010.5, 640.2));
/// # Ok::<(), deepsft_formats::FormatError>(())
/// ```
///
/// # Errors
/// [`FormatError::CameraFile`] when it is not JSON, lacks a field (NaN is not JSON) or has two lenses,
/// [`FormatError::Geometry`] when a value is none a camera can have.
pub fn camera_from_json(json: &[u8]) -> Result<Camera, FormatError> {
    let file: CameraFile =
        serde_json::from_slice(json).map_err(|error| FormatError::CameraFile(json_reason(&error)))?;
    file.camera()
}

/// The content of a `camera.json` that [`camera_from_json`] reads as `camera`; `distortion` is left out for
/// a lens without.
pub fn camera_to_json(camera: &Camera) -> String {
    let mut file = CameraFile::new(camera);
    file.distortion = file.distortion.filter(|distortion| distortion[..] != [0.0; 5]);
    // Numbers and fixed keys: there is nothing in it that JSON could not say.
    serde_json::to_string_pretty(&file).unwrap_or_default()
}
