//! Winograd's convolution: input transform, products at the points, output transform.

use super::filters::{POINTS, filter_at_point};
use super::tiling::Tiling;
use super::transforms::{InputTransform, OutputTransform};
use crate::cpu::gemm::{MatrixRows, Overwrite, PackedMatrix, multiply};
use crate::cpu::layer_spec::LayerRun;
use crate::cpu::layout::{Scratch, padded_channels};
use crate::cpu::team::{Chunks, MAX_THREADS, in_parallel};
use crate::plan::{Convolution, LayerInput, MapShape};
use pulp::{Simd, WithSimd};
use std::ops::Range;

/// Tiles that are taken through all three parts together at least: what lies between them stays in the cache.
const CHUNK: usize = 48;

/// Numbers between the parts where threads share them.
const MAX_BETWEEN: usize = 1 << 22;

/// Filters at all points, numbers, above which each thread takes some of the points rather than some of the rows: then filters come
/// from memory once.
const MAX_OWN: usize = 1 << 18;

/// Filters at all points that are worth it to sum for each kind of position, numbers: what fits into a processor's cache.
const MAX_SUMMED: usize = 1 << 21;

/// Rows of a product that take as long as its matrix takes to come from memory.
const ROWS_PER_MATRIX: usize = 30;

/// A convolution's filters at the points.
#[derive(Debug)]
pub(crate) struct Winograd {
    filters: Vec<PackedMatrix>,
    pub(crate) tiling: Tiling,
    /// Whether threads share the points.
    pub(crate) is_shared: bool,
}

impl Winograd {
    /// `None` for convolutions that are not of this kind.
    pub(crate) fn new(convolution: &Convolution, output: MapShape, shapes: &[MapShape], width: usize) -> Option<Self> {
        let (filters, first) = (&convolution.filters, convolution.inputs[0]);
        let (kernel, border) = (filters.kernel, filters.kernel / 2);
        let pitch = padded_channels(filters.biases.len());
        let (channels, inputs) = convolution.input_channels(shapes, padded_channels);
        let is_alike = |input: &LayerInput| (input.factor, input.cropped) == (first.factor, first.cropped);
        let summed = POINTS * inputs * pitch * first.factor * first.factor;
        let is_summed =
            convolution.inputs.iter().all(is_alike) && summed <= MAX_SUMMED && first.cropped[0] < first.factor;
        let factor = if is_summed { first.factor } else { 1 };
        if convolution.stride > 1 || kernel == 1 || border > factor {
            return None;
        }
        let outputs = factor * factor * pitch;
        let points = |tile: usize| (tile + 2) * (tile + 2);
        let is_shared = |tile: usize| points(tile) * inputs * outputs > MAX_OWN;
        // Products of a tile's side, with their matrices' way from memory if they are large.
        let [rows, columns] = [output.height, output.width].map(|side| side.div_ceil(factor));
        let cost = |tile: usize| {
            let waiting = if is_shared(tile) { ROWS_PER_MATRIX } else { 0 };
            points(tile) * (rows.div_ceil(tile) * columns.div_ceil(tile) + waiting)
        };
        let tile = if cost(2) < cost(4) { 2 } else { 4 };
        let (points, is_shared) = (points(tile), is_shared(tile));
        // The padding behind the last channel is not read.
        let read = channels.last().map_or(0, |last| last + 1);
        let mut at_points: Vec<PackedMatrix> = (0..points).map(|_| PackedMatrix::new(read, outputs, width)).collect();
        for (index, weights) in filters.weights.chunks_exact(kernel * kernel).enumerate() {
            let (output, input) = (index / filters.inputs, channels[index % filters.inputs]);
            for kind in 0..factor * factor {
                let mut filter = [[0.0; 3]; 3];
                for (tap, &weight) in weights.iter().enumerate() {
                    let (i, j) = (kind / factor + tap / kernel, kind % factor + tap % kernel);
                    let [i, j] = [i, j].map(|at| (at + factor - border) / factor);
                    filter[i][j] += f64::from(weight);
                }
                for (point, packed) in at_points.iter_mut().enumerate() {
                    packed.set(input, kind * pitch + output, filter_at_point(tile, filter, point));
                }
            }
        }
        let across = columns.div_ceil(tile);
        let most = MAX_BETWEEN / (points * (inputs + outputs));
        let tiles = if is_shared { most } else { 0 };
        let together = ((tiles.max(CHUNK) + across / 2) / across).max(1);
        let tiling = Tiling {
            inputs,
            outputs,
            factor,
            tile,
            across,
            together,
            height: output.height,
            missing: if factor > 1 { first.cropped[0] } else { 0 },
        };
        Some(Self {
            filters: at_points,
            tiling,
            is_shared,
        })
    }

    pub(crate) fn run(&self, layer: LayerRun<'_>, scratches: &mut [Scratch], shared: &mut Scratch, out: &mut [f32]) {
        let tile_rows = 0..self.tiling.tile_rows();
        if self.is_shared {
            let mut team = [(); MAX_THREADS];
            self.make(layer, &mut team[..scratches.len()], shared, tile_rows, out);
            return;
        }
        let row = layer.spec.row();
        let out = Chunks {
            values: out,
            length: self.tiling.rows_of_tile() * row,
            missing: self.tiling.missing * row,
        };
        in_parallel(scratches, tile_rows, out, &|scratch, tile_rows, out| {
            self.make(layer, &mut [()], scratch, tile_rows, out.values);
        });
    }

    /// Makes these rows of tiles, `out`, with as many threads as `team` has members.
    fn make(
        &self,
        layer: LayerRun<'_>,
        team: &mut [()],
        scratch: &mut Scratch,
        tile_rows: Range<usize>,
        out: &mut [f32],
    ) {
        let (arch, tiling, row) = (layer.arch, &self.tiling, layer.spec.row());
        let (read, products) = (scratch.read.values_mut(), scratch.products.values_mut());
        let first_row = tiling.rows_made(tile_rows.clone()).start;
        for start in tile_rows.clone().step_by(tiling.together) {
            let chunk = start..tile_rows.end.min(start + tiling.together);
            let tiles = chunk.start * tiling.across..chunk.end * tiling.across;
            let length = tiling.points() * tiling.input_pitch();
            let transformed = Chunks::whole(&mut read[..tiles.len() * length], length);
            in_parallel(team, tiles.clone(), transformed, &|_, tiles, read| {
                arch.dispatch(InputTransform {
                    tiling,
                    layer,
                    tiles,
                    read: read.values,
                });
            });
            let read = &*read;
            let sums = Chunks::whole(products, tiling.point_pitch());
            in_parallel(team, 0..tiling.points(), sums, &|_, points, products| {
                arch.dispatch(Products {
                    winograd: self,
                    points,
                    tiles: tiles.len(),
                    read,
                    products: products.values,
                });
            });
            let made = tiling.rows_made(chunk.clone());
            let out = Chunks {
                values: &mut out[(made.start - first_row) * row..(made.end - first_row) * row],
                length: tiling.rows_of_tile() * row,
                missing: if start == 0 { tiling.missing * row } else { 0 },
            };
            let products = &*products;
            in_parallel(team, chunk.clone(), out, &|_, tile_rows, out| {
                arch.dispatch(OutputTransform {
                    tiling,
                    layer,
                    tile_rows,
                    first_tile: tiles.start,
                    products,
                    out: out.values,
                });
            });
        }
    }
}

/// The products at the points `points`: `products` [point, tile, channel].
struct Products<'a> {
    winograd: &'a Winograd,
    points: Range<usize>,
    tiles: usize,
    read: &'a [f32],
    products: &'a mut [f32],
}

impl WithSimd for Products<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let tiling = &self.winograd.tiling;
        let (outputs, input_pitch) = (tiling.outputs, tiling.input_pitch());
        for (point, values) in self.points.zip(self.products.chunks_exact_mut(tiling.point_pitch())) {
            let rows = MatrixRows {
                values: &self.read[point * input_pitch..],
                count: self.tiles,
                across: self.tiles,
                step: tiling.points() * input_pitch,
                line: 0,
                parts: 1,
                pitch: 0,
            };
            let mut epilogue = Overwrite { values, outputs };
            multiply::<S, false>(simd, &rows, &self.winograd.filters[point], &mut epilogue);
        }
    }
}
