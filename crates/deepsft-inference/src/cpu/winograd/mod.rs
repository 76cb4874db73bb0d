//! 3 x 3 convolutions in a quarter of the multiplications: Winograd's F(4 x 4, 3 x 3) and F(2 x 2, 3 x 3).
//!
//! Lavin and Gray, "Fast Algorithms for Convolutional Neural Networks" (CVPR 2016), section 4. The output is cut into tiles of 4 x 4
//! places. Each reads 6 x 6; a linear map B takes them to 36 numbers, at each of which the convolution is a product of matrices
//! over the channels, and a linear map A takes the sums back. In single precision the results differ from direct sums by about 1e-6
//! of the largest number read. Tiles of 2 x 2 need more multiplications and fewer filters: wide layers of small maps take as long as
//! their filters take to come from memory.
//!
//! A convolution of an up-sampled map is done before the up-sampling: there are `factor` x `factor` kinds of places, and each kind's
//! filters, summed over the places that share a number, are again 3 x 3.

mod filters;
mod transforms;

use super::MAX_THREADS;
use super::bands::{Units, in_bands};
use super::buffer::{BLOCK, padded};
use super::direct::channels;
use super::layer::{Layer, Maps, Scratch};
use super::product::{Packed, Rows, Sink, multiply};
use crate::plan::{Convolution, Input, MapShape};
pub(crate) use filters::POINTS;
use filters::filter_at;
#[cfg(feature = "webgpu")]
pub(crate) use filters::{READ, TILE, filter_at_points};
use pulp::{Arch, Simd, WithSimd};
use std::ops::Range;
use transforms::{ToPlaces, ToPoints};
pub use transforms::{to_places, to_points};

/// Tiles that are taken through all three parts together at least: what lies between them stays in the cache.
const CHUNK: usize = 48;

/// Numbers between the parts where threads share them.
const MAX_BETWEEN: usize = 1 << 22;

/// Filters at all points, numbers, above which each thread takes some of the points rather than some of the rows: then filters come
/// from memory once.
const MAX_OWN: usize = 1 << 18;

/// Filters at all points that are worth it to sum for each kind of place, numbers: what fits into a processor's cache.
const MAX_SUMMED: usize = 1 << 21;

/// Rows of a product that take as long as its matrix takes to come from memory.
const ROWS_PER_MATRIX: usize = 30;

pub(crate) struct Winograd {
    /// Filters at each point.
    filters: Vec<Packed>,
    inputs: usize,
    /// Outputs of all kinds of places.
    outputs: usize,
    /// Up-sampling that comes after the products.
    pub(crate) factor: usize,
    /// Side of a tile.
    tile: usize,
    /// Tiles beside one another.
    across: usize,
    /// Rows of tiles that are taken through all parts together.
    together: usize,
    /// Whether threads share the points.
    pub(crate) is_shared: bool,
}

/// What works on what.
#[derive(Clone, Copy)]
struct At<'a> {
    arch: Arch,
    layer: &'a Layer,
    maps: Maps<'a>,
}

impl Winograd {
    /// `None` for convolutions that are not of this kind.
    pub(crate) fn new(convolution: &Convolution, output: MapShape, shapes: &[MapShape], lanes: usize) -> Option<Self> {
        let (filters, first) = (&convolution.filters, convolution.inputs[0]);
        let (kernel, border, pitch) = (filters.kernel, filters.kernel / 2, padded(filters.biases.len()));
        let (places, inputs) = channels(convolution, shapes);
        let is_alike = |input: &Input| (input.factor, input.cropped) == (first.factor, first.cropped);
        let summed = POINTS * inputs * pitch * first.factor * first.factor;
        let is_summed =
            convolution.inputs.iter().all(is_alike) && summed <= MAX_SUMMED && first.cropped[0] < first.factor;
        let factor = if is_summed { first.factor } else { 1 };
        if convolution.stride > 1 || kernel == 1 || border > factor {
            return None;
        }
        let outputs = factor * factor * pitch;
        // Products of a tile's side, with their matrices' way from memory if they are large.
        let [height, width] = [output.height, output.width].map(|side| side.div_ceil(factor));
        let cost = |tile: usize| {
            let points = (tile + 2) * (tile + 2);
            let waiting = if points * inputs * outputs > MAX_OWN {
                ROWS_PER_MATRIX
            } else {
                0
            };
            points * (height.div_ceil(tile) * width.div_ceil(tile) + waiting)
        };
        let tile = if cost(2) < cost(4) { 2 } else { 4 };
        let points = (tile + 2) * (tile + 2);
        // The padding behind the last channel is not read.
        let read = places.last().map_or(0, |last| last + 1);
        let mut at_points: Vec<Packed> = (0..points).map(|_| Packed::new(read, outputs, lanes)).collect();
        for (index, weights) in filters.weights.chunks_exact(kernel * kernel).enumerate() {
            let (output, input) = (index / filters.inputs, places[index % filters.inputs]);
            for kind in 0..factor * factor {
                let mut filter = [[0.0; 3]; 3];
                for (place, &weight) in weights.iter().enumerate() {
                    let (i, j) = (kind / factor + place / kernel, kind % factor + place % kernel);
                    let [i, j] = [i, j].map(|at| (at + factor - border) / factor);
                    filter[i][j] += f64::from(weight);
                }
                for (point, packed) in at_points.iter_mut().enumerate() {
                    packed.set(input, kind * pitch + output, filter_at(tile, filter, point));
                }
            }
        }
        let across = width.div_ceil(tile);
        let is_shared = points * inputs * outputs > MAX_OWN;
        let tiles = if is_shared {
            MAX_BETWEEN / (points * (inputs + outputs))
        } else {
            0
        };
        let together = ((tiles.max(CHUNK) + across / 2) / across).max(1);
        Some(Self {
            filters: at_points,
            inputs,
            outputs,
            factor,
            tile,
            across,
            together,
            is_shared,
        })
    }

    fn points(&self) -> usize {
        self.filters.len()
    }

    /// From a point's numbers of a tile to the next point's: an odd number of lines, so that they do not crowd in the cache.
    fn input_pitch(&self) -> usize {
        odd_lines(self.inputs)
    }

    /// From a point's products to the next point's.
    fn point_pitch(&self) -> usize {
        odd_lines(self.together * self.across * self.outputs)
    }

    /// Lengths of what lies between the parts.
    pub(crate) fn scratch(&self) -> [usize; 2] {
        let read = self.together * self.across * self.points() * self.input_pitch();
        [read, self.points() * self.point_pitch()]
    }

    /// Rows of the output that a row of tiles makes, and how many of them the first row of tiles lacks.
    fn rows_of_unit(&self, convolution: &Convolution) -> (usize, usize) {
        let cropped = if self.factor > 1 {
            convolution.inputs[0].cropped[0]
        } else {
            0
        };
        (self.tile * self.factor, cropped)
    }

    /// The rows of the output that the units `units` make: rows of tiles.
    fn rows_made(&self, layer: &Layer, units: Range<usize>) -> Range<usize> {
        let (rows, missing) = self.rows_of_unit(&layer.convolution);
        let [start, end] = [units.start, units.end].map(|unit| (rows * unit).saturating_sub(missing));
        start..end.min(layer.output.height)
    }

    /// Makes the output, `out`.
    pub(crate) fn run(
        &self,
        arch: Arch,
        layer: &Layer,
        maps: Maps<'_>,
        scratches: &mut [Scratch],
        shared: &mut Scratch,
        out: &mut [f32],
    ) {
        let at = At { arch, layer, maps };
        let (rows, missing) = self.rows_of_unit(&layer.convolution);
        let units = 0..(layer.output.height + missing).div_ceil(rows);
        if self.is_shared {
            let mut team = [(); MAX_THREADS];
            self.make(at, &mut team[..scratches.len()], shared, units, out);
            return;
        }
        let row = layer.row();
        let out = Units {
            values: out,
            length: rows * row,
            missing: missing * row,
        };
        in_bands(scratches, units, out, &|scratch, units, out| {
            self.make(at, &mut [()], scratch, units, out.values);
        });
    }

    /// Makes the units `units` of the output, `out`, with as many threads as `team` has members.
    fn make(&self, at: At<'_>, team: &mut [()], scratch: &mut Scratch, units: Range<usize>, out: &mut [f32]) {
        let At { arch, layer, maps } = at;
        let row = layer.row();
        let (rows, missing) = self.rows_of_unit(&layer.convolution);
        let (read, products) = (scratch.read.values_mut(), scratch.products.values_mut());
        let first_row = self.rows_made(layer, units.clone()).start;
        for start in units.clone().step_by(self.together) {
            let chunk = start..units.end.min(start + self.together);
            let tiles = chunk.start * self.across..chunk.end * self.across;
            let length = self.points() * self.input_pitch();
            in_bands(
                team,
                tiles.clone(),
                Units::whole(&mut read[..tiles.len() * length], length),
                &|_, tiles, Units { values: read, .. }| match self.tile {
                    2 => arch.dispatch(ToPoints::<2, 4> {
                        winograd: self,
                        layer,
                        maps,
                        tiles,
                        read,
                    }),
                    _ => arch.dispatch(ToPoints::<4, 6> {
                        winograd: self,
                        layer,
                        maps,
                        tiles,
                        read,
                    }),
                },
            );
            let (read, length) = (&*read, self.point_pitch());
            in_bands(
                team,
                0..self.points(),
                Units::whole(products, length),
                &|_, points, products| {
                    arch.dispatch(Multiply {
                        winograd: self,
                        points,
                        tiles: tiles.len(),
                        read,
                        products: products.values,
                    });
                },
            );
            let made = self.rows_made(layer, chunk.clone());
            let out = &mut out[(made.start - first_row) * row..(made.end - first_row) * row];
            let out = Units {
                values: out,
                length: rows * row,
                missing: if start == 0 { missing * row } else { 0 },
            };
            let products = &*products;
            in_bands(team, chunk.clone(), out, &|_, units, Units { values: out, .. }| {
                let first_tile = chunk.start * self.across;
                match self.tile {
                    2 => arch.dispatch(ToPlaces::<2, 4> {
                        winograd: self,
                        layer,
                        maps,
                        units,
                        first_tile,
                        products,
                        out,
                    }),
                    _ => arch.dispatch(ToPlaces::<4, 6> {
                        winograd: self,
                        layer,
                        maps,
                        units,
                        first_tile,
                        products,
                        out,
                    }),
                }
            });
        }
    }
}

/// `numbers` rounded up to an odd number of cache lines: what lies so far apart does not crowd in the cache.
pub fn odd_lines(numbers: usize) -> usize {
    let lines = numbers.div_ceil(BLOCK);
    (lines + 1 - lines % 2) * BLOCK
}

/// The products at the points `points`: `products` [point, tile, channel].
struct Multiply<'a> {
    winograd: &'a Winograd,
    points: Range<usize>,
    tiles: usize,
    read: &'a [f32],
    products: &'a mut [f32],
}

impl WithSimd for Multiply<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self {
            winograd,
            points,
            tiles,
            read,
            products,
        } = self;
        let input_pitch = winograd.input_pitch();
        for (point, products) in points.zip(products.chunks_exact_mut(winograd.point_pitch())) {
            let rows = Rows {
                values: &read[point * input_pitch..],
                count: tiles,
                across: tiles,
                step: winograd.points() * input_pitch,
                line: 0,
                parts: 1,
                pitch: 0,
            };
            let outputs = winograd.outputs;
            let mut products = Products {
                values: products,
                outputs,
            };
            multiply::<S, false>(simd, &rows, &winograd.filters[point], &mut products);
        }
    }
}

/// The sums of the tiles at one point.
pub struct Products<'a> {
    /// [tile, output].
    pub values: &'a mut [f32],
    /// Padded.
    pub outputs: usize,
}

impl std::fmt::Debug for Products<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Products")
            .field("outputs", &self.outputs)
            .finish_non_exhaustive()
    }
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
