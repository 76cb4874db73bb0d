//! What lies where in the texture.

use glam::DVec2;
use std::ops::Range;

/// Cells along each side of the grid over the unit square.
const CELLS: usize = 64;

/// Numbers of things (faces, vertices) by the cells of a grid over the texture.
#[derive(Clone, Debug)]
pub(crate) struct TextureGrid {
    cells: Vec<Vec<u32>>,
}

impl TextureGrid {
    pub(crate) fn new() -> Self {
        Self {
            cells: vec![Vec::new(); CELLS * CELLS],
        }
    }

    /// Puts `number` into all cells between two corners.
    pub(crate) fn insert(&mut self, low: DVec2, high: DVec2, number: usize) {
        let (columns, rows) = Self::cells(low, high);
        for row in rows {
            for cell in &mut self.cells[row * CELLS..][columns.clone()] {
                cell.push(number as u32);
            }
        }
    }

    /// The columns and rows of cells between two corners, clamped into the grid.
    pub(crate) fn cells(low: DVec2, high: DVec2) -> (Range<usize>, Range<usize>) {
        let index = |t: f64| ((t * CELLS as f64).max(0.0) as usize).min(CELLS - 1);
        (index(low.x)..index(high.x) + 1, index(low.y)..index(high.y) + 1)
    }

    pub(crate) fn cell(&self, column: usize, row: usize) -> impl Iterator<Item = usize> + '_ {
        self.cells[row * CELLS + column].iter().map(|&number| number as usize)
    }
}

/// Gives the barycentric coordinates of `uv` in a triangle of the texture. Not finite in one without area.
pub fn texture_barycentric(uv: DVec2, [a, b, c]: [DVec2; 3]) -> [f64; 3] {
    let area = (b - a).perp_dot(c - a);
    let second = (uv - a).perp_dot(c - a) / area;
    let third = (b - a).perp_dot(uv - a) / area;
    [1.0 - second - third, second, third]
}
