//! What the network says of cells, and maps at pixels from it.

use super::cells::{LinearSample, PIXELS_PER_CELL, cells, upsampled};
use super::patches::PATCH;
use crate::config::NetworkConfig;
use crate::cpu::{Chunks, in_parallel, with_team};
use crate::stage::Stage;
use deepsft_geometry::glam::DVec3;
use deepsft_geometry::{GeometryError, Maps, OUTSIDE, RestSurface, check_size};
use pulp::{Arch, Simd, WithSimd};

/// Coordinates of an image's cells, on whichever device the network ran: u, v and d, or x, y, d and z of rest positions.
#[derive(Debug)]
pub(crate) struct CellMaps {
    image: [usize; 2],
    near_mm: f32,
    /// ln(far / near).
    span: f32,
    /// What the main block says and what is said after refinement, d in normalised log depth: of each coordinate for each cell.
    /// The fourth is empty where there are three.
    pub(super) main: [Vec<f32>; 4],
    pub(super) refined: [Vec<f32>; 4],
    /// Pixels from cells: rows and columns.
    pixels_from_cells: [Vec<LinearSample>; 2],
    /// One for each thread.
    lines: Vec<PixelRow>,
}

/// What is said along one row of pixels.
#[derive(Debug)]
struct PixelRow {
    /// Of the cells' columns.
    cells: Vec<f32>,
    /// The coordinates of the pixels, depth in mm.
    pixels: [Vec<f32>; 4],
}

impl CellMaps {
    /// `threads` will read.
    pub(crate) fn new(image: [usize; 2], config: &NetworkConfig, threads: usize) -> Self {
        let [rows, columns] = cells(image);
        let fourth = usize::from(config.has_rest_positions());
        let zeros = |length: usize| [length, length, length, fourth * length].map(|length| vec![0.0; length]);
        let range = config.depth_range;
        let line = |_| PixelRow {
            cells: vec![0.0; columns],
            pixels: zeros(columns * PIXELS_PER_CELL),
        };
        Self {
            image,
            near_mm: range.near_mm as f32,
            span: (range.far_mm / range.near_mm).ln() as f32,
            main: zeros(rows * columns),
            refined: zeros(rows * columns),
            pixels_from_cells: [rows, columns].map(|length| upsampled(length, PIXELS_PER_CELL)),
            lines: (0..threads).map(line).collect(),
        }
    }

    /// Takes on what a GPU found: of each cell a quad of coordinates.
    #[cfg(feature = "webgpu")]
    pub(crate) fn set(&mut self, main: &[f32], refined: &[f32]) {
        for (maps, quads) in [(&mut self.main, main), (&mut self.refined, refined)] {
            for (cell, quad) in quads.chunks_exact(4).enumerate() {
                let said = maps.iter_mut().filter(|map| !map.is_empty()).zip(quad);
                said.for_each(|(map, &value)| map[cell] = value);
            }
        }
    }

    /// The coordinates of all cells of 8 pixels, row after row, see [`crate::Executor::cells`].
    pub(crate) fn cells(&self, stage: Stage) -> [&[f32]; 4] {
        std::array::from_fn(|k| match (stage, k) {
            (Stage::RegistrationRefinement, _) | (Stage::DepthRefinement, 2) => &self.refined[k][..],
            (Stage::DepthRefinement | Stage::Main, _) => &self.main[k],
        })
    }

    /// The patch of a pixel, and which of its logits is the pixel's.
    pub(crate) fn index_in_mask(&self, x: usize, y: usize) -> (usize, usize) {
        let columns = self.pixels_from_cells[1].len() / PATCH;
        (y / PATCH * columns + x / PATCH, y % PATCH * PATCH + x % PATCH)
    }

    /// Writes the maps of the last image, see [`crate::Executor::read`]: `mask` gives the logit at an index of
    /// [`CellMaps::index_in_mask`].
    pub(crate) fn read(
        &mut self,
        stage: Stage,
        seen: Option<&[bool]>,
        surface: Option<&RestSurface>,
        mask: impl Fn(usize, usize) -> f32 + Sync,
        maps: &mut Maps,
    ) -> Result<(), GeometryError> {
        let [width, height] = self.image;
        check_size(maps.size(), (width, height))?;
        if let Some(seen) = seen {
            check_size((seen.len(), 1), (width * height, 1))?;
        }
        if !self.main[3].is_empty() && surface.is_none() {
            return Err(GeometryError::NoRestSurface);
        }
        let mut lines = std::mem::take(&mut self.lines);
        let in_mask = |x, y| {
            let (patch, within) = self.index_in_mask(x, y);
            mask(patch, within) >= 0.0
        };
        let is_seen = |x, y| seen.map_or_else(|| in_mask(x, y), |seen| seen[y * width + x]);
        let (depth, registration) = maps.parts_mut();
        let out = (Chunks::whole(depth, width), Chunks::whole(registration, width));
        let (cell_maps, arch, cells) = (&*self, Arch::new(), self.cells(stage));
        with_team(lines.len(), || {
            in_parallel(&mut lines, 0..height, out, &|line, rows, (depth, registration)| {
                let rows_out = (depth.values.chunks_exact_mut(width)).zip(registration.values.chunks_exact_mut(width));
                for (y, (depth, registration)) in rows.zip(rows_out) {
                    arch.dispatch(InterpolatedRow {
                        maps: cell_maps,
                        cells,
                        y,
                        line,
                    });
                    for (x, (depth, uv)) in depth.iter_mut().zip(registration).enumerate() {
                        let said = is_seen(x, y).then(|| line.registration(x, surface)).flatten();
                        (*depth, *uv) = said.map_or((OUTSIDE, [OUTSIDE; 2]), |uv| (line.pixels[2][x], uv));
                    }
                }
            });
        });
        self.lines = lines;
        Ok(())
    }
}

impl PixelRow {
    /// (u, v) at a pixel: of the point of the surface that is nearest to the rest position, if that is what is said.
    fn registration(&self, x: usize, surface: Option<&RestSurface>) -> Option<[f32; 2]> {
        let [a, b, _, c] = &self.pixels;
        match (c.get(x), surface) {
            (Some(&z), Some(surface)) => {
                let position = DVec3::new(a[x].into(), b[x].into(), z.into());
                Some(surface.registration(position)?.as_vec2().to_array())
            }
            _ => Some([a[x], b[x]]),
        }
    }
}

/// Takes cells to the pixels of the row `y`: `line`.
struct InterpolatedRow<'a> {
    maps: &'a CellMaps,
    cells: [&'a [f32]; 4],
    y: usize,
    line: &'a mut PixelRow,
}

impl WithSimd for InterpolatedRow<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let Self { maps, cells, y, line } = self;
        let row = maps.pixels_from_cells[0][y];
        let columns = line.cells.len();
        let [half, last] = [PIXELS_PER_CELL / 2, columns * PIXELS_PER_CELL - PIXELS_PER_CELL / 2];
        // Before the first cell's centre and behind the last one there is one cell, between two there are as many pixels as in a cell.
        let mut fractions = [0.0; PIXELS_PER_CELL];
        for (k, fraction) in fractions.iter_mut().enumerate() {
            *fraction = (k as f32 + 0.5) / PIXELS_PER_CELL as f32;
        }
        let said = cells
            .iter()
            .zip(&mut line.pixels)
            .filter(|(cells, _)| !cells.is_empty());
        for (cells, pixels) in said {
            let [above, below] = row.cells.map(|r| &cells[r * columns..][..columns]);
            for (value, (a, b)) in line.cells.iter_mut().zip(above.iter().zip(below)) {
                *value = a + (b - a) * row.fraction;
            }
            pixels[..half].fill(line.cells[0]);
            pixels[last..].fill(line.cells[columns - 1]);
            let between = pixels[half..last].as_chunks_mut::<PIXELS_PER_CELL>().0;
            for (pixels, pair) in between.iter_mut().zip(line.cells.windows(2)) {
                for (pixel, fraction) in pixels.iter_mut().zip(fractions) {
                    *pixel = pair[0] + (pair[1] - pair[0]) * fraction;
                }
            }
        }
        for depth in &mut line.pixels[2] {
            *depth = maps.near_mm * exp(*depth * maps.span);
        }
    }
}

/// e^x for |x| < 87, to 2e-7 of itself: two to the nearest whole power, times a polynomial (Cephes, `expf`). Without branches and
/// calls, so that compilers take many numbers at once.
#[inline(always)]
fn exp(x: f32) -> f32 {
    const LN_2: [f32; 2] = [355.0 / 512.0, -2.121_944_4e-4];
    /// Added, it leaves a number rounded, with the exponent's bias, in the lowest bits.
    const ROUNDING: f32 = 12_582_912.0 + 127.0;
    let x = x.clamp(-87.0, 87.0);
    let shifted = x * std::f32::consts::LOG2_E + ROUNDING;
    let power = shifted - ROUNDING;
    let rest = x - power * LN_2[0] - power * LN_2[1];
    let mut polynomial = 1.987_569_2e-4;
    for coefficient in [
        1.398_199_9e-3,
        8.333_452e-3,
        4.166_579_6e-2,
        1.666_666_5e-1,
        0.5,
        1.0,
        1.0,
    ] {
        polynomial = polynomial * rest + coefficient;
    }
    polynomial * f32::from_bits(shifted.to_bits() << 23)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_exponential_is_right_to_single_precision() {
        for k in -8700..=8700 {
            let x = k as f32 / 100.0;
            let truth = f64::from(x).exp();
            let error = (f64::from(exp(x)) - truth).abs() / truth;
            assert!(error < 2e-7, "e^{x} is {error:.1e} of itself off");
        }
    }
}
