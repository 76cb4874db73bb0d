//! Grey images.

use super::picture::Picture;

/// A grey image, row-major, 0..=255.
#[derive(Clone, Debug)]
pub(crate) struct GreyImage {
    pub width: usize,
    pub height: usize,
    pub values: Vec<f32>,
}

impl GreyImage {
    /// The [`luma`] of each pixel.
    pub fn of(picture: &Picture) -> Self {
        Self {
            width: picture.width(),
            height: picture.height(),
            values: picture.rgb().as_chunks().0.iter().map(|&c| luma(c)).collect(),
        }
    }
}

/// Rec. 601 luma of a stored (gamma) colour, 0..=255.
pub fn luma([r, g, b]: [u8; 3]) -> f32 {
    0.299 * f32::from(r) + 0.587 * f32::from(g) + 0.114 * f32::from(b)
}
