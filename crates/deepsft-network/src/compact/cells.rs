//! The grids in which the compact network sees an image.

/// Side of a patch that is embedded at once, pixels.
pub(super) const PATCH: usize = 4;

/// Side of a cell of the compact network's coordinate maps, pixels.
pub const PIXELS_PER_CELL: usize = 8;

/// Height and width of the compact network's input must be multiples of this: the stride of the bins.
pub const INPUT_MULTIPLE: usize = 16;
