//! Corners and descriptors of a picture at many sizes.

use crate::corners::CornerSearch;
use crate::descriptor::Descriptor;
use crate::pyramid::pyramid_levels;
use deepsft_geometry::Picture;
use deepsft_geometry::glam::Vec2;

/// Shortest side of a level, pixels: a smaller one has hardly any place for a descriptor.
const SHORTEST_SIDE: usize = 48;

/// Options of the search for features.
#[derive(Clone, Debug, PartialEq)]
pub struct FeatureOptions {
    /// Corners in all levels together, at most; a few more where cells are many. Default 2000.
    pub corners: usize,
    /// Levels of the pyramid, each 1.25 times smaller. Default 8.
    pub levels: usize,
    /// Least difference between a corner and the pixels around, grey levels. Default 8.
    pub threshold: u8,
}

impl Default for FeatureOptions {
    fn default() -> Self {
        Self {
            corners: 2000,
            levels: 8,
            threshold: 8,
        }
    }
}

/// A corner.
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
    all: Vec<Feature>,
    descriptors: Vec<Descriptor>,
}

impl Features {
    /// Finds the features of `picture`. Finer detail than a pixel of an image with 960 columns helps little: see
    /// [`crate::feature_image`]. A picture with a side beyond 65,535 pixels has no features.
    pub fn of(picture: &Picture, options: &FeatureOptions) -> Self {
        let mut features = Self::default();
        if picture.width().max(picture.height()) > usize::from(u16::MAX) {
            return features;
        }
        let levels = pyramid_levels(picture, SHORTEST_SIDE, options.levels);
        let whole: f32 = levels.iter().map(|l| (l.width * l.height) as f32).sum();
        let mut search = CornerSearch::default();
        for level in &levels {
            let part = (level.width * level.height) as f32 / whole;
            let budget = (part * options.corners as f32).ceil() as usize;
            for corner in search.corners(level, options.threshold, budget) {
                features.all.push(Feature {
                    position: level.position(corner.x, corner.y),
                    angle: corner.angle,
                    scale: level.scale,
                });
                features.descriptors.push(Descriptor::of(level, corner));
            }
        }
        features
    }

    /// Returns the number of features.
    pub fn len(&self) -> usize {
        self.all.len()
    }

    /// Reports whether there is none.
    pub fn is_empty(&self) -> bool {
        self.all.is_empty()
    }

    pub(crate) fn all(&self) -> &[Feature] {
        &self.all
    }

    /// One descriptor for each feature.
    pub(crate) fn descriptors(&self) -> &[Descriptor] {
        &self.descriptors
    }
}
