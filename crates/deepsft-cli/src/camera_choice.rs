//! Which camera an image was taken by, and how reports tell it.

use crate::failure::BlameInput;
use anyhow::{Result, bail};
use deepsft_formats::CameraFile;
use deepsft_geometry::{Camera, Picture};
use serde::Serialize;
use std::path::Path;

/// Pixels by which an image may be longer or shorter than the camera file's aspect ratio tells.
const ROUNDING_PX: f64 = 1.0;

/// A camera as reports have it: the fields of `camera.json` and where they come from.
#[derive(Serialize)]
pub struct CameraReport {
    #[serde(flatten)]
    camera: CameraFile,
    /// `file`, `file, resized`, `assumed` (a typical phone) or `model`.
    source: &'static str,
}

impl CameraReport {
    /// The report of `camera`, which comes from `source`.
    pub fn new(camera: &Camera, source: &'static str) -> Self {
        let camera = CameraFile::new(camera);
        Self { camera, source }
    }
}

/// The camera for `image`, that of a camera file or else a typical one, and where it comes from.
pub fn camera_of(image: &Picture, file: Option<(&Camera, &Path)>) -> Result<(Camera, &'static str)> {
    match file {
        Some((camera, path)) => camera_for(image, camera).blame("camera file", path),
        None => Ok((Camera::typical(image.width() as u32, image.height() as u32)?, "assumed")),
    }
}

/// The camera of a file, for an image of this size.
fn camera_for(image: &Picture, camera: &Camera) -> Result<(Camera, &'static str)> {
    let (width, height) = (image.width() as u32, image.height() as u32);
    if (width, height) == (camera.width(), camera.height()) {
        return Ok((*camera, "file"));
    }
    let expected_height = f64::from(width) * f64::from(camera.height()) / f64::from(camera.width());
    if (expected_height - f64::from(height)).abs() > ROUNDING_PX {
        bail!(
            "it is for images of {} x {} pixels, this one has {width} x {height}",
            camera.width(),
            camera.height()
        );
    }
    Ok((camera.resized(width, height)?, "file, resized"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reports_say_of_a_lens_without_distortion_that_it_has_none() {
        let camera = Camera::pinhole(1920, 1080, 1400.0, 1410.0, 950.0, 545.0).unwrap();
        let report = serde_json::to_value(CameraReport::new(&camera, "file")).unwrap();
        let expected = serde_json::json!({
            "width": 1920, "height": 1080, "fx": 1400.0, "fy": 1410.0, "cx": 950.0, "cy": 545.0,
            "distortion": [0.0, 0.0, 0.0, 0.0, 0.0], "source": "file",
        });
        assert_eq!(report, expected);
    }

    #[test]
    fn a_camera_serves_images_of_its_aspect_ratio_only() {
        let camera = Camera::pinhole(1920, 1080, 1400.0, 1410.0, 950.0, 545.0).unwrap();
        let image = |width, height| Picture::from_fn(width, height, |_, _| [0; 3]);
        assert_eq!(camera_for(&image(1920, 1080), &camera).unwrap(), (camera, "file"));
        let (half, source) = camera_for(&image(960, 540), &camera).unwrap();
        assert_eq!(
            (half.focal().x, half.principal_point().y, source),
            (700.0, 272.5, "file, resized")
        );
        let error = camera_for(&image(1080, 1920), &camera).unwrap_err();
        assert_eq!(
            error.to_string(),
            "it is for images of 1920 x 1080 pixels, this one has 1080 x 1920"
        );
    }
}
