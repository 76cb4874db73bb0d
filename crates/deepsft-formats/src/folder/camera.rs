//! Cameras of the disk.

use crate::camera::camera_from_json;
use crate::error::FormatError;
use deepsft_geometry::Camera;
use std::fs;
use std::path::Path;

/// Reads a `camera.json`.
///
/// # Errors
/// [`FormatError::Unusable`] when it is missing, corrupt or unfit.
pub fn read_camera(path: &Path) -> Result<Camera, FormatError> {
    let bytes = fs::read(path).map_err(|error| FormatError::unusable("camera file", path, error))?;
    camera_from_json(&bytes).map_err(|error| FormatError::unusable("camera file", path, error))
}
