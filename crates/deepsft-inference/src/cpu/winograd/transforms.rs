//! The transforms of Winograd's convolutions: maps to points and back.

use super::tiling::Tiling;
use crate::cpu::layer_spec::LayerRun;
use crate::cpu::layout::{padded_channels, vector};
use pulp::{Simd, WithSimd};
use std::ops::Range;

/// Takes what the tiles `tiles` read to the points: `read` [tile, point, channel].
pub(super) struct InputTransform<'a> {
    pub(super) tiling: &'a Tiling,
    pub(super) layer: LayerRun<'a>,
    pub(super) tiles: Range<usize>,
    pub(super) read: &'a mut [f32],
}

impl WithSimd for InputTransform<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        match self.tiling.tile {
            2 => self.run::<S, 2, 4>(simd),
            _ => self.run::<S, 4, 6>(simd),
        }
    }
}

impl InputTransform<'_> {
    #[inline(always)]
    fn run<S: Simd, const TILE: usize, const READ: usize>(self, simd: S) {
        let (tiling, layer, read) = (self.tiling, self.layer, self.read);
        let zero = simd.splat_f32s(0.0);
        let (across, point_pitch) = (tiling.across, tiling.input_pitch());
        let mut first_channel = 0;
        for input in &layer.spec.convolution.inputs {
            let map = layer.maps.view(input.map);
            let pitch = map.pitch();
            // Where the up-sampling comes later, rows that are cropped are read too.
            let ([height, width], factor, top) = match tiling.factor {
                1 => (input.size(map.shape), input.factor, input.cropped[0]),
                _ => ([map.shape.height, map.shape.width], 1, 0),
            };
            for (tile, read) in self.tiles.clone().zip(read.chunks_exact_mut(READ * READ * point_pitch)) {
                // Where the tile's numbers lie; the border has none. Its first row and column are before the tile's first.
                let mut positions = [[None; READ]; READ];
                for (i, positions) in positions.iter_mut().enumerate() {
                    let y = (TILE * (tile / across) + i).wrapping_sub(1);
                    for (j, position) in positions.iter_mut().enumerate() {
                        let x = (TILE * (tile % across) + j).wrapping_sub(1);
                        if y < height && x < width {
                            *position = Some(((y + top) / factor * map.shape.width + x / factor) * pitch);
                        }
                    }
                }
                for channel in (0..pitch).step_by(S::F32_LANES) {
                    let mut numbers = [[zero; READ]; READ];
                    for (row, positions) in numbers.iter_mut().zip(&positions) {
                        for (number, position) in row.iter_mut().zip(positions) {
                            if let Some(position) = position {
                                *number = vector::<S>(map.values, position + channel);
                                if input.rectified {
                                    *number = simd.max_f32s(zero, *number);
                                }
                            }
                        }
                    }
                    let points = both_ways::<S, InputLines, READ, READ>(simd, numbers);
                    for (point, &value) in points.as_flattened().iter().enumerate() {
                        let at = point * point_pitch + first_channel + channel;
                        S::as_mut_simd_f32s(&mut read[at..at + S::F32_LANES]).0[0] = value;
                    }
                }
            }
            first_channel += pitch;
        }
    }
}

/// Takes the sums at the points back to the positions of the tiles in the rows `tile_rows` and finishes them; `products` begin with
/// the tile `first_tile`.
pub(super) struct OutputTransform<'a> {
    pub(super) tiling: &'a Tiling,
    pub(super) layer: LayerRun<'a>,
    pub(super) tile_rows: Range<usize>,
    pub(super) first_tile: usize,
    pub(super) products: &'a [f32],
    pub(super) out: &'a mut [f32],
}

impl WithSimd for OutputTransform<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        match self.tiling.tile {
            2 => self.run::<S, 2, 4>(simd),
            _ => self.run::<S, 4, 6>(simd),
        }
    }
}

impl OutputTransform<'_> {
    #[inline(always)]
    fn run<S: Simd, const TILE: usize, const READ: usize>(self, simd: S) {
        let (tiling, layer, products, out) = (self.tiling, self.layer, self.products, self.out);
        let width = layer.spec.output.width;
        let (across, factor) = (tiling.across, tiling.factor);
        let pitch = padded_channels(layer.spec.output.channels);
        let (outputs, point_pitch) = (tiling.outputs, tiling.point_pitch());
        let first_row = tiling.rows_made(self.tile_rows.clone()).start;
        let zero = simd.splat_f32s(0.0);
        for tile in self.tile_rows.start * across..self.tile_rows.end * across {
            let (tile_row, tile_column) = (TILE * (tile / across), TILE * (tile % across));
            for kind in 0..factor * factor {
                for channel in (0..pitch).step_by(S::F32_LANES) {
                    let at = (tile - self.first_tile) * outputs + kind * pitch + channel;
                    let mut columns = [[zero; READ]; READ];
                    for (j, column) in columns.iter_mut().enumerate() {
                        for (i, number) in column.iter_mut().enumerate() {
                            *number = vector::<S>(products, (i * READ + j) * point_pitch + at);
                        }
                    }
                    let columns: [[S::f32s; TILE]; TILE] = both_ways::<S, OutputLines, READ, TILE>(simd, columns);
                    for i in 0..TILE {
                        let y = (factor * (tile_row + i) + kind / factor).checked_sub(tiling.missing);
                        let Some(y) = y.filter(|&y| y < tiling.height) else {
                            continue;
                        };
                        for (j, column) in columns.iter().enumerate() {
                            let x = factor * (tile_column + j) + kind % factor;
                            if x < width {
                                let value = layer.finished(simd, column[i], layer.skip(y, x), channel);
                                let at = ((y - first_row) * width + x) * pitch + channel;
                                S::as_mut_simd_f32s(&mut out[at..at + S::F32_LANES]).0[0] = value;
                            }
                        }
                    }
                }
            }
        }
    }
}

/// A linear map of a tile's rows and columns. No closure: those are not compiled for the processor's vectors.
pub trait LineTransform<const FROM: usize, const TO: usize> {
    /// Transforms a row or a column.
    fn line<S: Simd>(simd: S, line: [S::f32s; FROM]) -> [S::f32s; TO];
}

/// Transforms the rows of a tile, then the columns: M X M^T.
#[inline(always)]
pub fn both_ways<S: Simd, M: LineTransform<FROM, TO>, const FROM: usize, const TO: usize>(
    simd: S,
    tile: [[S::f32s; FROM]; FROM],
) -> [[S::f32s; TO]; TO] {
    let zero = simd.splat_f32s(0.0);
    let (mut rows, mut transformed) = ([[zero; TO]; FROM], [[zero; TO]; TO]);
    for (row, line) in rows.iter_mut().zip(tile) {
        *row = M::line(simd, line);
    }
    for j in 0..TO {
        let mut column = [zero; FROM];
        for (number, row) in column.iter_mut().zip(&rows) {
            *number = row[j];
        }
        for (row, value) in transformed.iter_mut().zip(M::line(simd, column)) {
            row[j] = value;
        }
    }
    transformed
}

/// Takes what a tile reads to the points (B^T): 6 numbers for tiles of 4, 4 for tiles of 2.
#[derive(Debug)]
pub struct InputLines;

impl<const READ: usize> LineTransform<READ, READ> for InputLines {
    #[inline(always)]
    fn line<S: Simd>(simd: S, d: [S::f32s; READ]) -> [S::f32s; READ] {
        let mut points = d;
        if READ == 4 {
            points[0] = simd.sub_f32s(d[0], d[2]);
            points[1] = simd.add_f32s(d[1], d[2]);
            points[2] = simd.sub_f32s(d[2], d[1]);
            points[3] = simd.sub_f32s(d[3], d[1]);
            return points;
        }
        let (a, b) = (plus(simd, d[4], -4.0, d[2]), plus(simd, d[3], -4.0, d[1]));
        let (c, e) = (simd.sub_f32s(d[4], d[2]), simd.sub_f32s(d[3], d[1]));
        points[0] = plus(simd, plus(simd, d[4], -5.0, d[2]), 4.0, d[0]);
        points[1] = simd.add_f32s(a, b);
        points[2] = simd.sub_f32s(a, b);
        points[3] = plus(simd, c, 2.0, e);
        points[4] = plus(simd, c, -2.0, e);
        points[5] = plus(simd, plus(simd, d[5], -5.0, d[3]), 4.0, d[1]);
        points
    }
}

/// Takes sums at the points to the tile's positions (A^T): 4 of 6, or 2 of 4.
#[derive(Debug)]
pub struct OutputLines;

impl<const READ: usize, const TILE: usize> LineTransform<READ, TILE> for OutputLines {
    #[inline(always)]
    fn line<S: Simd>(simd: S, m: [S::f32s; READ]) -> [S::f32s; TILE] {
        let mut positions = [m[0]; TILE];
        let (a, b) = (simd.add_f32s(m[1], m[2]), simd.sub_f32s(m[1], m[2]));
        if TILE == 2 {
            positions[0] = simd.add_f32s(m[0], a);
            positions[1] = simd.add_f32s(b, m[3]);
            return positions;
        }
        let (c, d) = (simd.add_f32s(m[3], m[4]), simd.sub_f32s(m[3], m[4]));
        positions[0] = simd.add_f32s(simd.add_f32s(m[0], a), c);
        positions[1] = plus(simd, b, 2.0, d);
        positions[2] = plus(simd, a, 4.0, c);
        positions[3] = simd.add_f32s(plus(simd, b, 8.0, d), m[5]);
        positions
    }
}

/// Returns a + factor b.
#[inline(always)]
pub fn plus<S: Simd>(simd: S, a: S::f32s, factor: f32, b: S::f32s) -> S::f32s {
    simd.mul_add_e_f32s(simd.splat_f32s(factor), b, a)
}
