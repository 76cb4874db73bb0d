//! A point of the target and its image.

use deepsft_geometry::glam::DVec2;

/// Fewest correspondences of a usable view.
pub const MIN_CORRESPONDENCES: usize = 8;

/// A point of a flat target and its pixel in a photograph.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Correspondence {
    /// The point, mm in any frame of the target's plane.
    pub place_mm: DVec2,
    /// Its image, pixels.
    pub pixel: DVec2,
}
