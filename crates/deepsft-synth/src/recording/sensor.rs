//! The cameras of an RGB-D recording: its `camera.json`.

use crate::error::SynthError;
use deepsft_formats::{CameraFile, FormatError, json_reason};
use deepsft_geometry::Camera;
use deepsft_geometry::glam::{DAffine3, DMat3, DVec3};
use serde::{Deserialize, Serialize};

/// Units of a depth picture in a metre when the recording does not say: millimetres, as Open3D and the Kinect have it.
const DEFAULT_DEPTH_SCALE: f64 = 1000.0;

/// Largest departure of a rotation's columns from being orthonormal: numbers typed with four digits.
const ROTATION_TOLERANCE: f64 = 1e-3;

/// A colour camera and a depth camera fixed to each other.
#[derive(Clone, Debug, PartialEq)]
pub struct RgbdSensor {
    /// The colour camera.
    pub color: Camera,
    /// The depth camera; the colour camera itself where depth is registered to the colour pictures.
    pub depth: Camera,
    /// Pose of the depth camera in the colour camera's frame, mm.
    pub color_from_depth: DAffine3,
    /// Units of a depth picture in a metre: 1000 for millimetres, 5000 in the TUM data sets.
    pub depth_scale: f64,
    /// Whether a program made the recording up.
    pub simulated: bool,
}

#[derive(Serialize, Deserialize)]
struct SensorJson {
    #[serde(flatten)]
    color: CameraFile,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    depth_scale: Option<f64>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    depth_camera: Option<CameraFile>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    color_from_depth: Option<[[f64; 4]; 3]>,
    #[serde(default)]
    simulated: bool,
}

impl RgbdSensor {
    /// A sensor whose depth is registered to the colour camera, in millimetres.
    pub fn registered(color: Camera) -> Self {
        Self {
            color,
            depth: color,
            color_from_depth: DAffine3::IDENTITY,
            depth_scale: DEFAULT_DEPTH_SCALE,
            simulated: false,
        }
    }

    /// Whether the depth pictures are already in the colour camera's image.
    pub fn is_registered(&self) -> bool {
        self.depth == self.color && self.color_from_depth == DAffine3::IDENTITY
    }

    /// Reads the text of a `camera.json` (fields: see [`crate::Recording`]).
    ///
    /// # Errors
    /// [`SynthError::Refused`] says what is wrong with it.
    pub fn from_json(text: &str) -> Result<Self, SynthError> {
        Self::parsed(text).map_err(SynthError::Refused)
    }

    fn parsed(text: &str) -> Result<Self, String> {
        let json: SensorJson = serde_json::from_str(text).map_err(|error| json_reason(&error))?;
        let camera = |json: &CameraFile| json.camera().map_err(|error: FormatError| error.to_string());
        let color = camera(&json.color)?;
        let depth_scale = json.depth_scale.unwrap_or(DEFAULT_DEPTH_SCALE);
        if !(depth_scale > 0.0 && depth_scale.is_finite()) {
            return Err(format!("depth_scale is {depth_scale}, expected the units in a metre"));
        }
        let depth = match (&json.depth_camera, &json.color_from_depth) {
            (Some(depth), _) => {
                camera(&depth.clone().or_centers_of(&json.color)).map_err(|error| format!("depth_camera: {error}"))?
            }
            (None, None) => color,
            (None, Some(_)) => return Err("color_from_depth needs the depth camera's own intrinsics".to_owned()),
        };
        Ok(Self {
            color,
            depth,
            color_from_depth: json
                .color_from_depth
                .map_or(Ok(DAffine3::IDENTITY), |rows| pose(&rows))?,
            depth_scale,
            simulated: json.simulated,
        })
    }

    /// The text of a `camera.json` that [`RgbdSensor::from_json`] reads as this sensor.
    pub fn to_json(&self) -> String {
        let (rotation, shift) = (self.color_from_depth.matrix3, self.color_from_depth.translation);
        let row = |k: usize| {
            let r = rotation.row(k);
            [r.x, r.y, r.z, shift[k]]
        };
        let apart = !self.is_registered();
        let json = SensorJson {
            color: CameraFile::new(&self.color),
            depth_scale: Some(self.depth_scale),
            depth_camera: apart.then(|| CameraFile::new(&self.depth)),
            color_from_depth: apart.then(|| [row(0), row(1), row(2)]),
            simulated: self.simulated,
        };
        // Numbers and fixed keys: there is nothing in it that JSON could not say.
        serde_json::to_string_pretty(&json).unwrap_or_default()
    }
}

/// The pose of rows (r, r, r, t) with t in mm.
fn pose(rows: &[[f64; 4]; 3]) -> Result<DAffine3, String> {
    let row = |k: usize| DVec3::new(rows[k][0], rows[k][1], rows[k][2]);
    let rotation = DMat3::from_cols(row(0), row(1), row(2)).transpose();
    let error = (rotation * rotation.transpose() - DMat3::IDENTITY)
        .to_cols_array()
        .iter()
        .fold(0.0_f64, |worst, e| worst.max(e.abs()));
    // NaN is no rotation either.
    if error.is_nan() || error > ROTATION_TOLERANCE || rotation.determinant() < 0.0 {
        return Err("the first three columns of color_from_depth are not a rotation".to_owned());
    }
    let translation = DVec3::new(rows[0][3], rows[1][3], rows[2][3]);
    if !translation.is_finite() {
        return Err("the last column of color_from_depth is not finite".to_owned());
    }
    Ok(DAffine3::from_mat3_translation(rotation, translation))
}
