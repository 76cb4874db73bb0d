//! How well a camera is known before its image is looked at.

use deepsft_geometry::ImageSize;

/// Long side over short side of images as cameras take them.
const SHAPES: [f64; 4] = [1.0, 4.0 / 3.0, 3.0 / 2.0, 16.0 / 9.0];

/// How far the shape of an image may be from one of them, as a fraction.
const SAME_SHAPE: f64 = 0.01;

/// The origin of a camera.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CameraOrigin {
    /// It was calibrated, or somebody gave it.
    Known,
    /// Its focal length is what a photograph's EXIF data tell.
    Exif,
    /// It is [typical](deepsft_geometry::Camera::typical).
    Assumed,
}

impl CameraOrigin {
    /// Whether the camera is not known, and no camera takes images of `size`: somebody has cut away their borders. A crop looks through a
    /// longer lens, and EXIF data mostly stay as they were.
    pub fn is_cropped(self, size: ImageSize) -> bool {
        let sides = size.as_dvec2();
        let shape = sides.max_element() / sides.min_element();
        self != Self::Known && SHAPES.iter().all(|known| (shape / known - 1.0).abs() > SAME_SHAPE)
    }

    /// The standard deviation of ln f for an image of `size`, 0 for a known camera. EXIF data are rounded, and of phones four in five are
    /// within a sixth of the typical one.
    pub fn focal_deviation(self, size: ImageSize) -> f64 {
        match self {
            Self::Known => 0.0,
            _ if self.is_cropped(size) => 0.4,
            Self::Exif => 0.1,
            Self::Assumed => 0.2,
        }
    }
}
