//! What a compact network is made of.

use std::collections::BTreeMap;

/// Folded weights by their paths (`main.encode8.first.weight`), row-major: filters [out, in, kernel, kernel], biases [out].
pub type Weights = BTreeMap<String, Vec<f32>>;

/// Sides and constants of a compact network.
#[derive(Clone, Debug, PartialEq)]
pub struct CompactShape {
    /// Columns and rows of the image, pixels.
    pub image: [usize; 2],
    /// Channels at strides 4, 8, 16 and 32.
    pub channels: [usize; 4],
    /// Residual blocks at stride 32.
    pub blocks_at_32: usize,
    /// Bins of u, v and depth.
    pub bins: [usize; 3],
    /// Channels of the refinement blocks.
    pub refinement_channels: usize,
    /// Channels of the mask's head.
    pub mask_channels: usize,
    /// Whether the registration jumps at seams of the texture: then no depth is measured from it.
    pub seams: bool,
    /// Size of the template, mm.
    pub template_size_mm: [f64; 2],
    /// Focal length of the training camera, pixels.
    pub focal: f64,
    /// Principal point of the training camera, pixels.
    pub principal_point: [f64; 2],
    /// Depths of the normalised log depths 0 and 1, mm.
    pub depth_range_mm: [f64; 2],
}

impl CompactShape {
    /// Rows and columns of cells of 8 pixels; the image is padded to an even number of them.
    pub(super) fn cells(&self) -> [usize; 2] {
        let [width, height] = self.image;
        [height, width].map(|side| 2 * side.div_ceil(16))
    }
}
