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
    /// `file`, `file, resized`, `exif`, `assumed` (a typical phone) or `model`.
    source: &'static str,
}

impl CameraReport {
    /// The report of `camera`, which comes from `source`.
    pub fn new(camera: &Camera, source: &'static str) -> Self {
        let camera = CameraFile::new(camera);
        Self { camera, source }
    }
}

/// The camera of `--camera`: that of a file, or one of the paper's by name where there is no such file.
pub fn read(path: &Path) -> Result<Camera> {
    let preset = path.to_str().and_then(Camera::preset);
    match preset.filter(|_| !path.exists()) {
        Some(camera) => Ok(camera),
        None => Ok(deepsft_formats::read_camera(path)?),
    }
}

/// The camera for `image`, and where it comes from: a camera file, or else what its photograph's EXIF data tell, or else a typical one.
pub fn camera_of(
    image: &Picture,
    file: Option<(&Camera, &Path)>,
    exif: Option<Camera>,
) -> Result<(Camera, &'static str)> {
    match (file, exif) {
        (Some((camera, path)), _) => camera_for(image, camera).blame("camera file", path),
        (None, Some(camera)) => Ok((camera, "exif")),
        _ => Ok((Camera::typical(image.size())?, "assumed")),
    }
}

/// The camera of a file, for an image of this size.
fn camera_for(image: &Picture, camera: &Camera) -> Result<(Camera, &'static str)> {
    if image.size() == camera.size() {
        return Ok((*camera, "file"));
    }
    let expected_height = image.width() as f64 * camera.size().height as f64 / camera.size().width as f64;
    if (expected_height - image.height() as f64).abs() > ROUNDING_PX {
        bail!(
            "it is for images of {} pixels, this one has {}",
            camera.size(),
            image.size()
        );
    }
    Ok((camera.resized(image.size())?, "file, resized"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use deepsft_geometry::glam::DVec2;

    #[test]
    fn reports_say_of_a_lens_without_distortion_that_it_has_none() {
        let camera = Camera::pinhole((1920, 1080), DVec2::new(1400.0, 1410.0), DVec2::new(950.0, 545.0)).unwrap();
        let report = serde_json::to_value(CameraReport::new(&camera, "file")).unwrap();
        let expected = serde_json::json!({
            "width": 1920, "height": 1080, "fx": 1400.0, "fy": 1410.0, "cx": 950.0, "cy": 545.0,
            "distortion": [0.0, 0.0, 0.0, 0.0, 0.0], "source": "file",
        });
        assert_eq!(report, expected);
    }

    #[test]
    fn a_camera_file_goes_before_exif_and_exif_before_a_guess() {
        let image = Picture::from_fn(1920, 1080, |_, _| [0; 3]);
        let file = read(Path::new("kinect-v2")).unwrap();
        assert_eq!((file.focal().x, file.size()), (1057.8, (1920, 1080).into()));
        let exif = Camera::pinhole((1920, 1080), DVec2::splat(1500.0), DVec2::new(960.0, 540.0)).unwrap();
        let path = Path::new("kinect-v2");
        assert_eq!(
            camera_of(&image, Some((&file, path)), Some(exif)).unwrap(),
            (file, "file")
        );
        assert_eq!(camera_of(&image, None, Some(exif)).unwrap(), (exif, "exif"));
        let assumed = camera_of(&image, None, None).unwrap();
        assert_eq!((assumed.0.focal().x, assumed.1), (0.79 * 1920.0, "assumed"));
        assert!(
            read(Path::new("kinect-v3"))
                .unwrap_err()
                .to_string()
                .contains("kinect-v3")
        );
    }

    #[test]
    fn a_camera_serves_images_of_its_aspect_ratio_only() {
        let camera = Camera::pinhole((1920, 1080), DVec2::new(1400.0, 1410.0), DVec2::new(950.0, 545.0)).unwrap();
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
