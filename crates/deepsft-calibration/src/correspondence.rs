//! A point of the target and its image.

use deepsft_geometry::glam::DVec2;

/// Fewest correspondences of a view that is any good.
pub const MIN_CORRESPONDENCES: usize = 8;

/// A point of a flat target, and where a photograph shows it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Correspondence {
    /// The point, mm in any frame of the target's plane.
    pub place_mm: DVec2,
    /// Its image, pixels.
    pub pixel: DVec2,
}
