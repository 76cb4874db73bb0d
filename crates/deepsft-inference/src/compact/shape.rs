//! What a compact network is made of.

use super::depths::PIXELS_PER_CELL;
use std::collections::BTreeMap;

/// Folded weights by their paths (`main.encode8.first.weight`), row-major: filters [out, in, kernel, kernel], biases [out].
pub type Weights = BTreeMap<String, Vec<f32>>;

/// Rows and columns of cells of an image of `width` x `height` pixels, which is padded to an even number of them.
pub(super) fn cells([width, height]: [usize; 2]) -> [usize; 2] {
    [height, width].map(|side| 2 * side.div_ceil(2 * PIXELS_PER_CELL))
}
