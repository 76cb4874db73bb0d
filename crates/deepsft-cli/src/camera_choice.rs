//! Which camera an image was taken by, and how reports tell it.

use crate::failure::BlameInput;
use anyhow::{Result, anyhow, bail};
use deepsft::CameraOrigin;
use deepsft_formats::CameraFile;
use deepsft_geometry::{CalibratedCamera, Camera, Picture};
use serde::Serialize;
use std::path::Path;

/// Pixels by which an image may be longer or shorter than the camera file's aspect ratio tells.
const ROUNDING_PX: f64 = 1.0;

/// A camera as reports have it: the fields of `camera.json` and where they come from.
#[derive(Serialize)]
pub struct CameraReport {
    #[serde(flatten)]
    camera: CameraFile,
    /// `file`, `file, resized`, `file, turned`, `exif`, `assumed` (a typical phone), `sheet` or `model`.
    source: &'static str,
    /// Standard deviation of the focal length as a fraction of it, where the sheet told it.
    #[serde(skip_serializing_if = "Option::is_none")]
    focal_deviation: Option<f64>,
}

impl CameraReport {
    /// The report of `camera`, which comes from `source`.
    pub fn new(camera: &Camera, source: &'static str) -> Self {
        let camera = CameraFile::new(camera);
        Self {
            camera,
            source,
            focal_deviation: None,
        }
    }

    /// The report of a camera that the sheet in an image told.
    pub fn told(told: &CalibratedCamera) -> Self {
        Self {
            focal_deviation: Some(told.focal_deviation),
            ..Self::new(&told.camera, "sheet")
        }
    }
}

/// How well a camera is known that comes from `source`.
pub fn origin(source: &str) -> CameraOrigin {
    match source {
        "exif" => CameraOrigin::Exif,
        "assumed" => CameraOrigin::Assumed,
        _ => CameraOrigin::Known,
    }
}

/// The camera of `--camera`: that of a file, or one of the paper's by name where there is no such file.
pub fn read(path: &Path) -> Result<Camera> {
    let preset = path.to_str().and_then(Camera::preset);
    match preset.filter(|_| !path.exists()) {
        Some(camera) => Ok(camera),
        None if !path.exists() => {
            let reason = "there is no such file: check the path, or name one of kinect-v2, realsense-d435, gopro-hero3";
            Err(anyhow!(reason)).blame("camera file", path)
        }
        None => Ok(deepsft_formats::read_camera(path)?),
    }
}

/// The camera for `image`, which was turned by so many `quarters` clockwise since it was taken, and where it comes from: a camera file, or
/// else what its photograph's EXIF data tell, or else a typical one.
pub fn camera_of(
    image: &Picture,
    quarters: usize,
    file: Option<(&Camera, &Path)>,
    exif: Option<Camera>,
) -> Result<(Camera, &'static str)> {
    match (file, exif) {
        (Some((camera, path)), _) => camera_for(image, quarters, camera).blame("camera file", path),
        (None, Some(camera)) => Ok((camera, "exif")),
        _ => Ok((Camera::typical(image.size())?, "assumed")),
    }
}

/// The camera of a file, for an image of this size that was turned.
fn camera_for(image: &Picture, quarters: usize, camera: &Camera) -> Result<(Camera, &'static str)> {
    let turned = |quarters: usize| (0..(4 - quarters) % 4).fold(*camera, |camera, _| camera.turned_anticlockwise());
    // A camera is calibrated as its sensor lies. One that fits the upright image alone was calibrated upright; one that fits neither way
    // round but for a quarter was held upright by a phone that does not tell.
    for quarters in [quarters, 0, 1] {
        let camera = turned(quarters);
        let expected_height = image.width() as f64 * camera.size().height as f64 / camera.size().width as f64;
        if (expected_height - image.height() as f64).abs() <= ROUNDING_PX {
            let source = match (quarters, image.size() == camera.size()) {
                (0, true) => "file",
                (0, false) => "file, resized",
                _ => "file, turned",
            };
            return Ok((camera.resized(image.size())?, source));
        }
    }
    bail!(
        "it is for images of {} pixels, this one has {}: give the camera that took it, or none",
        camera.size(),
        image.size()
    );
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
        let given = Some((&file, Path::new("kinect-v2")));
        let of = |given, exif| camera_of(&image, 0, given, exif).unwrap();
        assert_eq!(of(given, Some(exif)), (file, "file"));
        assert_eq!(of(None, Some(exif)), (exif, "exif"));
        let assumed = of(None, None);
        assert_eq!((assumed.0.focal().x, assumed.1), (0.79 * 1920.0, "assumed"));
        let error = read(Path::new("kinect-v3")).unwrap_err().to_string();
        assert!(error.contains("kinect-v3: there is no such file: check the path, or name one of kinect-v2"));
    }

    #[test]
    fn a_camera_serves_images_of_its_aspect_ratio_and_is_turned_with_them() {
        let camera = Camera::pinhole((1920, 1080), DVec2::new(1400.0, 1410.0), DVec2::new(950.0, 545.0)).unwrap();
        let of = |(width, height), quarters| {
            let image = Picture::from_fn(width, height, |_, _| [0; 3]);
            camera_for(&image, quarters, &camera)
        };
        for (size, quarters, focal, centre, source) in [
            ((1920, 1080), 0, [1400.0, 1410.0], [950.0, 545.0], "file"),
            ((960, 540), 0, [700.0, 705.0], [475.0, 272.5], "file, resized"),
            // Of the first row becomes the last column, the last row, the first column.
            ((1080, 1920), 1, [1410.0, 1400.0], [535.0, 950.0], "file, turned"),
            ((1920, 1080), 2, [1400.0, 1410.0], [970.0, 535.0], "file, turned"),
            ((540, 960), 3, [705.0, 700.0], [272.5, 485.0], "file, turned"),
        ] {
            let (camera, told) = of(size, quarters).unwrap();
            let found = (camera.focal().to_array(), camera.principal_point().to_array(), told);
            assert_eq!(found, (focal, centre, source));
        }
        // Nobody has said which way.
        assert_eq!(of((1080, 1920), 0).unwrap().1, "file, turned");
        let error = of((1080, 1080), 0).unwrap_err();
        assert_eq!(
            error.to_string(),
            "it is for images of 1920 x 1080 pixels, this one has 1080 x 1080: give the camera that took it, or none"
        );
    }
}
