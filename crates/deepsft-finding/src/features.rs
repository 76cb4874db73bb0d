//! Corners and descriptors of a picture at many sizes.

use crate::corners::corners;
use crate::descriptor::Descriptor;
use crate::pyramid::{pyramid_levels, resized};
use deepsft_geometry::glam::Vec2;
use deepsft_geometry::{Camera, GeometryError, Picture};

/// Longest side of the image that features are taken from, pixels: twice the canonical one, in which an A4 sheet 90 cm away is
/// only 125 pixels long. Larger images are shrunk to it. Not swept; time grows with its square.
const LONGEST_SIDE: usize = 960;

#[derive(Clone, Copy, Debug)]
pub(crate) struct FeatureOptions {
    /// Corners in all levels together, at most; a few more where cells are many.
    pub corners: usize,
    /// Longest side that a smaller picture is enlarged to, pixels.
    pub longest_side: usize,
    /// Levels of the pyramid, each 1.25 times smaller.
    pub levels: usize,
    /// Least difference between a corner and the pixels around, grey levels.
    pub threshold: u8,
}

/// For images of cameras.
pub(crate) const IMAGE: FeatureOptions = FeatureOptions {
    corners: 2000,
    longest_side: 0,
    levels: 8,
    threshold: 8,
};

#[derive(Clone, Copy, Debug)]
pub(crate) struct Feature {
    /// Position in the whole picture, pixels, pixel centres at half integers.
    pub position: Vec2,
    /// Direction, radians.
    pub angle: f32,
    /// Pixels of the whole picture per pixel of the level that has the corner.
    pub scale: f32,
}

/// The features of one picture: corners at many sizes with their descriptors.
#[derive(Clone, Debug, Default)]
pub struct Features {
    pub(crate) all: Vec<Feature>,
    pub(crate) descriptors: Vec<Descriptor>,
}

impl Features {
    /// Finds the features of `image`, shrunk to at most 960 pixels along its longer side, with the camera of the shrunk image: they are in its
    /// pixels.
    ///
    /// # Errors
    /// [`GeometryError::CameraParameter`] for a camera without pixels.
    pub fn of(image: &Picture, camera: &Camera) -> Result<(Self, Camera), GeometryError> {
        let image = resized(image, LONGEST_SIDE);
        let camera = camera.resized(image.size())?;
        Ok((Self::search(&image, IMAGE), camera))
    }

    /// Finds the features of `image` at twice the size of [`Features::of`]: a second look, for small sheets. More wrong matches agree in it.
    ///
    /// Up to 960 pixels the image is enlarged, and positions are in its own pixels. A larger one is shrunk less, to at most 1920 pixels along its longer
    /// side. `None` where that is not one and a half times the size: it finds hardly more, and takes more time than the first look.
    ///
    /// # Errors
    /// As [`Features::of`].
    pub fn in_detail(image: &Picture, camera: &Camera) -> Result<Option<(Self, Camera)>, GeometryError> {
        let longest = image.width().max(image.height());
        let seen = longest.min(LONGEST_SIDE);
        let longest_side = (2 * seen).min(longest.max(LONGEST_SIDE));
        if longest_side * 2 < seen * 3 {
            return Ok(None);
        }
        let image = resized(image, longest_side);
        let camera = camera.resized(image.size())?;
        let options = FeatureOptions { longest_side, ..IMAGE };
        Ok(Some((Self::search(&image, options), camera)))
    }

    /// The features of `picture`, whose sides are at most 65,535 pixels.
    pub(crate) fn search(picture: &Picture, options: FeatureOptions) -> Self {
        let mut features = Self::default();
        let levels = pyramid_levels(picture, options.longest_side, options.levels);
        let whole: f32 = levels.iter().map(|l| (l.width * l.height) as f32).sum();
        for level in &levels {
            let part = (level.width * level.height) as f32 / whole;
            let budget = (part * options.corners as f32).ceil() as usize;
            for corner in corners(level, options.threshold, budget) {
                features.all.push(Feature {
                    position: level.position(corner.x, corner.y),
                    angle: corner.angle,
                    scale: level.scale,
                });
                features.descriptors.push(Descriptor::of(level, &corner));
            }
        }
        features
    }

    /// Reports whether there is none.
    pub fn is_empty(&self) -> bool {
        self.all.is_empty()
    }
}
