//! From cells to maps at pixels.

use super::depths::PIXELS_PER_CELL;
use super::network::PATCH;
use super::positions::{Between, cells, upsampled};
use crate::config::NetworkConfig;
use crate::stage::Stage;
use deepsft_geometry::{GeometryError, Maps, check_size};

/// Cells beside one another whose u or v differ by more than this belong to different charts.
const SEAM_JUMP: f32 = 0.12;

/// What a compact network said of an image's cells, wherever it ran.
pub(super) struct Reading {
    image: [usize; 2],
    seams: bool,
    near_mm: f32,
    /// ln(far / near).
    span: f32,
    /// (u, v, d) of the main block and after refinement, d in normalised log depth, for each cell.
    pub(super) main: [Vec<f32>; 3],
    pub(super) refined: [Vec<f32>; 3],
    /// Pixels from cells: rows and columns.
    pixels_from_cells: [Vec<Between>; 2],
    /// u, v and d of the cells' columns at one row of pixels.
    line: [Vec<f32>; 3],
}

impl Reading {
    pub(super) fn new(image: [usize; 2], config: &NetworkConfig) -> Self {
        let [rows, columns] = cells(image);
        let three = |length: usize| [(); 3].map(|()| vec![0.0; length]);
        let range = config.depth_range;
        Self {
            image,
            seams: config.as_compact().is_some_and(|layers| layers.seams),
            near_mm: range.near_mm as f32,
            span: (range.far_mm / range.near_mm).ln() as f32,
            main: three(rows * columns),
            refined: three(rows * columns),
            pixels_from_cells: [rows, columns].map(|length| upsampled(length, PIXELS_PER_CELL)),
            line: three(columns),
        }
    }

    /// (u, v, d) of all cells of 8 pixels, d in normalised log depth: row after row.
    pub(super) fn cells(&self, stage: Stage) -> [&[f32]; 3] {
        let ([u, v, d], [fine_u, fine_v, fine_d]) = (&self.main, &self.refined);
        match stage {
            Stage::Main => [u, v, d],
            Stage::DepthRefinement => [u, v, fine_d],
            Stage::RegistrationRefinement => [fine_u, fine_v, fine_d],
        }
    }

    /// The patch of a pixel, and which of its logits is the pixel's.
    pub(super) fn place_in_mask(&self, x: usize, y: usize) -> (usize, usize) {
        let columns = self.pixels_from_cells[1].len() / PATCH;
        (y / PATCH * columns + x / PATCH, y % PATCH * PATCH + x % PATCH)
    }

    /// Writes the maps of the last image: depth (mm) and registration at the pixels of `seen` (row-major) if given, else where the
    /// mask's probability is at least one half: `mask` gives the logit of a place of [`Reading::place_in_mask`].
    ///
    /// # Errors
    /// [`GeometryError::MapSize`] when `maps` or `seen` have another size than the image.
    pub(super) fn read(
        &mut self,
        stage: Stage,
        seen: Option<&[bool]>,
        mask: impl Fn(usize, usize) -> f32,
        maps: &mut Maps,
    ) -> Result<(), GeometryError> {
        let [width, height] = self.image;
        check_size(maps.size(), (width, height))?;
        if let Some(seen) = seen {
            check_size((seen.len(), 1), (width * height, 1))?;
        }
        let mut line = std::mem::take(&mut self.line);
        let (near, span) = (self.near_mm, self.span);
        let is_seen = |x, y| {
            let (patch, within) = self.place_in_mask(x, y);
            mask(patch, within) >= 0.0
        };
        let cells = self.cells(stage);
        let columns = self.pixels_from_cells[1].len() / PIXELS_PER_CELL;
        for y in 0..height {
            let row = self.pixels_from_cells[0][y];
            for (line, cells) in line.iter_mut().zip(cells) {
                let [above, below] = row.cells.map(|r| &cells[r * columns..][..columns]);
                for (value, (a, b)) in line.iter_mut().zip(above.iter().zip(below)) {
                    *value = a + (b - a) * row.fraction;
                }
            }
            for (x, &column) in self.pixels_from_cells[1].iter().enumerate().take(width) {
                let pixel = y * width + x;
                if !seen.map_or_else(|| is_seen(x, y), |seen| seen[pixel]) {
                    maps.clear(pixel);
                    continue;
                }
                let [mut u, mut v, d] = [0, 1, 2].map(|k| {
                    let [a, b] = column.cells.map(|c| line[k][c]);
                    a + (b - a) * column.fraction
                });
                if self.seams && cells[..2].iter().any(|map| jumps(map, columns, row, column)) {
                    let cell = y / PIXELS_PER_CELL * columns + x / PIXELS_PER_CELL;
                    (u, v) = (cells[0][cell], cells[1][cell]);
                }
                maps.set(pixel, near * (d * span).exp(), [u, v]);
            }
        }
        self.line = line;
        Ok(())
    }
}

/// Whether the four cells around a sample are of different charts.
fn jumps(map: &[f32], columns: usize, row: Between, column: Between) -> bool {
    let (mut least, mut most) = (f32::MAX, f32::MIN);
    for r in row.cells {
        for c in column.cells {
            let value = map[r * columns + c];
            (least, most) = (least.min(value), most.max(value));
        }
    }
    most - least > SEAM_JUMP
}
