//! 3 x 3 convolutions in a quarter of the multiplications: Winograd's F(4 x 4, 3 x 3).
//!
//! Lavin and Gray, "Fast Algorithms for Convolutional Neural Networks" (CVPR 2016), section 4. The output is cut into tiles of 4 x 4
//! places. Each reads 6 x 6; a linear map B takes them to 36 numbers, at each of which the convolution is a product of matrices
//! over the channels, and a linear map A takes the sums back. In single precision the results differ from direct sums by about 1e-6
//! of the largest number read.
//!
//! A convolution of an up-sampled map is done before the up-sampling: there are `factor` x `factor` kinds of places, and each kind's
//! filters, summed over the places that share a number, are again 3 x 3.

use super::buffer::padded;
use super::direct::channels;
use super::layer::{Layer, Maps, Scratch, vector};
use super::product::{Packed, Rows, Sink, multiply};
use crate::plan::{Convolution, Input, MapShape};
use pulp::Simd;
use std::ops::Range;

/// Side of a tile, and of what it reads.
pub(crate) const TILE: usize = 4;
const READ: usize = 6;

/// Points at which the products are taken.
const POINTS: usize = READ * READ;

/// Tiles that are taken through all three parts together: what lies between them stays in the cache.
const CHUNK: usize = 48;

/// Takes a filter's row to the points.
const G: [[f64; 3]; READ] = [
    [1.0 / 4.0, 0.0, 0.0],
    [-1.0 / 6.0, -1.0 / 6.0, -1.0 / 6.0],
    [-1.0 / 6.0, 1.0 / 6.0, -1.0 / 6.0],
    [1.0 / 24.0, 1.0 / 12.0, 1.0 / 6.0],
    [1.0 / 24.0, -1.0 / 12.0, 1.0 / 6.0],
    [0.0, 0.0, 1.0],
];

/// Filters at all points that are worth it to sum for each kind of place, numbers: what fits into a processor's cache.
const MOST_SUMMED: usize = 1 << 21;

pub(crate) struct Winograd {
    /// Filters at each point.
    filters: Vec<Packed>,
    inputs: usize,
    /// Outputs of all kinds of places.
    outputs: usize,
    /// Up-sampling that comes after the products.
    pub(crate) factor: usize,
}

impl Winograd {
    /// `None` for convolutions that are not of this kind.
    pub(crate) fn new(convolution: &Convolution, shapes: &[MapShape], lanes: usize) -> Option<Self> {
        let (filters, first) = (&convolution.filters, convolution.inputs[0]);
        let (kernel, border, pitch) = (filters.kernel, filters.kernel / 2, padded(filters.biases.len()));
        let (places, inputs) = channels(convolution, shapes);
        let is_alike = |input: &Input| (input.factor, input.cropped) == (first.factor, first.cropped);
        let summed = POINTS * inputs * pitch * first.factor * first.factor;
        let is_summed =
            convolution.inputs.iter().all(is_alike) && summed <= MOST_SUMMED && first.cropped[0] < first.factor;
        let factor = if is_summed { first.factor } else { 1 };
        if convolution.stride > 1 || kernel == 1 || border > factor {
            return None;
        }
        let outputs = factor * factor * pitch;
        // The padding behind the last channel is not read.
        let read = places.last().map_or(0, |last| last + 1);
        let mut at_points: Vec<Packed> = (0..POINTS).map(|_| Packed::new(read, outputs, lanes)).collect();
        for (index, weights) in filters.weights.chunks_exact(kernel * kernel).enumerate() {
            let (output, input) = (index / filters.inputs, places[index % filters.inputs]);
            for kind in 0..factor * factor {
                let mut filter = [[0.0; 3]; 3];
                for (place, &weight) in weights.iter().enumerate() {
                    let (i, j) = (kind / factor + place / kernel, kind % factor + place % kernel);
                    let [i, j] = [i, j].map(|at| (at + factor - border) / factor);
                    filter[i][j] += f64::from(weight);
                }
                // G g, then (G g) G^T.
                let dot = |a: [f64; 3], b: [f64; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
                let columns: [[f64; READ]; 3] = std::array::from_fn(|j| G.map(|g| dot(g, filter.map(|row| row[j]))));
                for (point, packed) in at_points.iter_mut().enumerate() {
                    let row = columns.map(|column| column[point / READ]);
                    packed.set(input, kind * pitch + output, dot(G[point % READ], row) as f32);
                }
            }
        }
        Some(Self {
            filters: at_points,
            inputs,
            outputs,
            factor,
        })
    }

    pub(crate) fn scratch(&self) -> [usize; 2] {
        [self.inputs, self.outputs].map(|channels| POINTS * CHUNK * channels)
    }

    /// Rows of the output that a row of tiles makes, and how many of them the first row of tiles lacks.
    pub(crate) fn rows_of_unit(&self, convolution: &Convolution) -> (usize, usize) {
        let cropped = if self.factor > 1 {
            convolution.inputs[0].cropped[0]
        } else {
            0
        };
        (TILE * self.factor, cropped)
    }

    /// The rows of the output that the units `units` make.
    pub(crate) fn rows_made(&self, layer: &Layer, units: Range<usize>) -> Range<usize> {
        let (rows, missing) = self.rows_of_unit(&layer.convolution);
        let [start, end] = [units.start, units.end].map(|unit| (rows * unit).saturating_sub(missing));
        start..end.min(layer.output.height)
    }

    /// Tiles beside one another.
    fn across(&self, layer: &Layer) -> usize {
        (layer.output.width / self.factor).div_ceil(TILE)
    }

    #[inline(always)]
    pub(crate) fn run<S: Simd>(
        &self,
        simd: S,
        layer: &Layer,
        maps: &Maps<'_>,
        scratch: &mut Scratch,
        units: Range<usize>,
        out: &mut [f32],
    ) {
        let across = self.across(layer);
        let tiles = units.start * across..units.end * across;
        let first_row = self.rows_made(layer, units).start;
        for first in tiles.clone().step_by(CHUNK) {
            let chunk = first..tiles.end.min(first + CHUNK);
            self.read(simd, layer, maps, chunk.clone(), scratch.read.values_mut());
            let (read, products) = (scratch.read.values(), scratch.products.values_mut());
            for (point, filters) in self.filters.iter().enumerate() {
                let rows = Rows {
                    values: &read[point * CHUNK * self.inputs..],
                    count: chunk.len(),
                    across: CHUNK,
                    step: self.inputs,
                    line: 0,
                    parts: 1,
                    pitch: 0,
                };
                let mut products = Products {
                    values: &mut products[point * CHUNK * self.outputs..][..CHUNK * self.outputs],
                    outputs: self.outputs,
                };
                multiply::<S, false>(simd, &rows, filters, &mut products);
            }
            self.write(simd, layer, maps, (chunk, first_row), scratch.products.values(), out);
        }
    }

    /// Takes what the tiles `chunk` read to the points: `read` [points, tiles, channels].
    #[inline(always)]
    fn read<S: Simd>(&self, simd: S, layer: &Layer, maps: &Maps<'_>, chunk: Range<usize>, read: &mut [f32]) {
        let zero = simd.splat_f32s(0.0);
        let across = self.across(layer);
        let mut first_channel = 0;
        for input in &layer.convolution.inputs {
            let map = maps.view(input.map);
            let pitch = map.pitch();
            // Where the up-sampling comes later, rows that are cropped are read too.
            let ([height, width], factor, top) = match self.factor {
                1 => (input.size(map.shape), input.factor, input.cropped[0]),
                _ => ([map.shape.height, map.shape.width], 1, 0),
            };
            for (t, tile) in chunk.clone().enumerate() {
                // Where the tile's numbers lie; the border has none. Its first row and column are before the tile's first.
                let mut places = [[None; READ]; READ];
                for (i, places) in places.iter_mut().enumerate() {
                    let y = (TILE * (tile / across) + i).wrapping_sub(1);
                    for (j, place) in places.iter_mut().enumerate() {
                        let x = (TILE * (tile % across) + j).wrapping_sub(1);
                        if y < height && x < width {
                            *place = Some(((y + top) / factor * map.shape.width + x / factor) * pitch);
                        }
                    }
                }
                for channel in (0..pitch).step_by(S::F32_LANES) {
                    let mut rows = [[zero; READ]; READ];
                    for (row, places) in rows.iter_mut().zip(&places) {
                        for (number, place) in row.iter_mut().zip(places) {
                            if let Some(place) = place {
                                let value = vector::<S>(map.values, place + channel);
                                *number = if input.rectified {
                                    simd.max_f32s(zero, value)
                                } else {
                                    value
                                };
                            }
                        }
                        *row = to_points(simd, *row);
                    }
                    for j in 0..READ {
                        let mut column = [zero; READ];
                        for (number, row) in column.iter_mut().zip(&rows) {
                            *number = row[j];
                        }
                        for (i, value) in to_points(simd, column).into_iter().enumerate() {
                            let at = ((i * READ + j) * CHUNK + t) * self.inputs + first_channel + channel;
                            S::as_mut_simd_f32s(&mut read[at..at + S::F32_LANES]).0[0] = value;
                        }
                    }
                }
            }
            first_channel += pitch;
        }
    }

    /// Takes the sums at the points back to the tiles' places and finishes them; `out` begins with the row `first_row`.
    #[inline(always)]
    fn write<S: Simd>(
        &self,
        simd: S,
        layer: &Layer,
        maps: &Maps<'_>,
        (chunk, first_row): (Range<usize>, usize),
        products: &[f32],
        out: &mut [f32],
    ) {
        let MapShape {
            channels,
            height,
            width,
        } = layer.output;
        let (across, factor, pitch) = (self.across(layer), self.factor, padded(channels));
        let (_, top) = self.rows_of_unit(&layer.convolution);
        let zero = simd.splat_f32s(0.0);
        for (t, tile) in chunk.enumerate() {
            let (tile_row, tile_column) = (TILE * (tile / across), TILE * (tile % across));
            for kind in 0..factor * factor {
                for channel in (0..pitch).step_by(S::F32_LANES) {
                    let mut rows = [[zero; READ]; TILE];
                    for j in 0..READ {
                        let mut column = [zero; READ];
                        for (i, number) in column.iter_mut().enumerate() {
                            let at = ((i * READ + j) * CHUNK + t) * self.outputs + kind * pitch + channel;
                            *number = vector::<S>(products, at);
                        }
                        for (row, value) in rows.iter_mut().zip(to_places(simd, column)) {
                            row[j] = value;
                        }
                    }
                    for (i, row) in rows.into_iter().enumerate() {
                        let Some(y) = (factor * (tile_row + i) + kind / factor)
                            .checked_sub(top)
                            .filter(|&y| y < height)
                        else {
                            continue;
                        };
                        for (j, sums) in to_places(simd, row).into_iter().enumerate() {
                            let x = factor * (tile_column + j) + kind % factor;
                            if x < width {
                                let value = layer.finished(simd, sums, layer.added(maps, y, x), channel);
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

/// The sums of the tiles at one point.
struct Products<'a> {
    values: &'a mut [f32],
    outputs: usize,
}

impl<S: Simd> Sink<S> for Products<'_> {
    #[inline(always)]
    fn begin(&mut self, _: S, _: Range<usize>) {}

    #[inline(always)]
    fn store(&mut self, _: S, row: usize, output: usize, sums: &[S::f32s]) {
        let (to, _) = S::as_mut_simd_f32s(&mut self.values[row * self.outputs + output..]);
        for (to, &sum) in to.iter_mut().zip(sums) {
            *to = sum;
        }
    }
}

/// B^T: a row or column of what a tile reads, at the points.
#[inline(always)]
fn to_points<S: Simd>(simd: S, read: [S::f32s; READ]) -> [S::f32s; READ] {
    let [d0, d1, d2, d3, d4, d5] = read;
    let (a, b) = (plus(simd, d4, -4.0, d2), plus(simd, d3, -4.0, d1));
    let (c, d) = (simd.sub_f32s(d4, d2), simd.sub_f32s(d3, d1));
    [
        plus(simd, plus(simd, d4, -5.0, d2), 4.0, d0),
        simd.add_f32s(a, b),
        simd.sub_f32s(a, b),
        plus(simd, c, 2.0, d),
        plus(simd, c, -2.0, d),
        plus(simd, plus(simd, d5, -5.0, d3), 4.0, d1),
    ]
}

/// A^T: sums at the points of a row or column, at the tile's places.
#[inline(always)]
fn to_places<S: Simd>(simd: S, sums: [S::f32s; READ]) -> [S::f32s; TILE] {
    let [m0, m1, m2, m3, m4, m5] = sums;
    let (a, b) = (simd.add_f32s(m1, m2), simd.sub_f32s(m1, m2));
    let (c, d) = (simd.add_f32s(m3, m4), simd.sub_f32s(m3, m4));
    [
        simd.add_f32s(simd.add_f32s(m0, a), c),
        plus(simd, b, 2.0, d),
        plus(simd, a, 4.0, c),
        simd.add_f32s(plus(simd, b, 8.0, d), m5),
    ]
}

/// a + factor b
#[inline(always)]
fn plus<S: Simd>(simd: S, a: S::f32s, factor: f32, b: S::f32s) -> S::f32s {
    simd.mul_add_e_f32s(simd.splat_f32s(factor), b, a)
}
