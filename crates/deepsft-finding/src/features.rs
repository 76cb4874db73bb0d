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

    /// Finds the features of `image` enlarged to twice its size, at most to 960 pixels along its longer side; positions are in its own pixels. A second
    /// look: small sheets are found, but more wrong matches agree. `None` of an image that is as large already.
    pub fn enlarged(image: &Picture) -> Option<Self> {
        let longest = image.width().max(image.height());
        let longest_side = LONGEST_SIDE.min(2 * longest);
        (longest < LONGEST_SIDE).then(|| Self::search(image, FeatureOptions { longest_side, ..IMAGE }))
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
