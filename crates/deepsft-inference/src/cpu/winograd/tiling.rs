//! How a layer's output is cut into tiles, and where a tile's numbers lie between the transforms.

use crate::cpu::layout::odd_cache_lines;
use std::ops::Range;

/// The tiles of a layer.
#[derive(Debug)]
pub(crate) struct Tiling {
    /// Padded channels that are read.
    pub(crate) inputs: usize,
    /// Outputs of all kinds of positions.
    pub(crate) outputs: usize,
    /// Up-sampling that comes after the products.
    pub(crate) factor: usize,
    /// Side of a tile.
    pub(crate) tile: usize,
    /// Tiles beside one another.
    pub(crate) across: usize,
    /// Rows of tiles that are taken through all parts together.
    pub(crate) together: usize,
    /// Rows of the output, and how many of them the first row of tiles lacks: what is cropped.
    pub(crate) height: usize,
    pub(crate) missing: usize,
}

impl Tiling {
    pub(crate) fn points(&self) -> usize {
        (self.tile + 2) * (self.tile + 2)
    }

    /// Numbers from a point of a tile to its next point: an odd number of lines, so that they do not crowd in the cache.
    pub(crate) fn input_pitch(&self) -> usize {
        odd_cache_lines(self.inputs)
    }

    /// Numbers from a point's products to the next point's.
    pub(crate) fn point_pitch(&self) -> usize {
        odd_cache_lines(self.together * self.across * self.outputs)
    }

    /// Lengths of what lies between the parts.
    pub(crate) fn scratch(&self) -> [usize; 2] {
        let read = self.together * self.across * self.points() * self.input_pitch();
        [read, self.points() * self.point_pitch()]
    }

    /// Rows of the output that a row of tiles makes.
    pub(crate) fn rows_of_tile(&self) -> usize {
        self.tile * self.factor
    }

    pub(crate) fn tile_rows(&self) -> usize {
        (self.height + self.missing).div_ceil(self.rows_of_tile())
    }

    /// The rows of the output that these rows of tiles make.
    pub(crate) fn rows_made(&self, tile_rows: Range<usize>) -> Range<usize> {
        let first = |row: usize| (self.rows_of_tile() * row).saturating_sub(self.missing);
        first(tile_rows.start)..first(tile_rows.end).min(self.height)
    }
}
