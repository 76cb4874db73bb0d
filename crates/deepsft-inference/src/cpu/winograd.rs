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

use super::MOST_THREADS;
use super::bands::in_bands;
use super::buffer::{BLOCK, padded};
use super::direct::channels;
use super::layer::{Layer, Maps, Scratch, vector};
use super::product::{Packed, Rows, Sink, multiply};
use crate::plan::{Convolution, Input, MapShape};
use pulp::{Arch, Simd, WithSimd};
use std::ops::Range;

/// Tiles that are taken through all three parts together at least: what lies between them stays in the cache.
const CHUNK: usize = 48;

/// Numbers between the parts where threads share them.
const MOST_BETWEEN: usize = 1 << 22;

/// Filters at all points, numbers, above which each thread takes some of the points rather than some of the rows: then filters come
/// from memory once.
const MOST_OWN: usize = 1 << 18;

/// Filters at all points that are worth it to sum for each kind of place, numbers: what fits into a processor's cache.
const MOST_SUMMED: usize = 1 << 21;

/// Rows of a product that take as long as its matrix takes to come from memory.
const ROWS_PER_MATRIX: usize = 30;

/// Takes a filter's row to the points, for tiles of 4.
const G4: [[f64; 3]; 6] = [
    [1.0 / 4.0, 0.0, 0.0],
    [-1.0 / 6.0, -1.0 / 6.0, -1.0 / 6.0],
    [-1.0 / 6.0, 1.0 / 6.0, -1.0 / 6.0],
    [1.0 / 24.0, 1.0 / 12.0, 1.0 / 6.0],
    [1.0 / 24.0, -1.0 / 12.0, 1.0 / 6.0],
    [0.0, 0.0, 1.0],
];

/// The same for tiles of 2.
const G2: [[f64; 3]; 4] = [[1.0, 0.0, 0.0], [0.5, 0.5, 0.5], [0.5, -0.5, 0.5], [0.0, 0.0, 1.0]];

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

impl Winograd {
    /// `None` for convolutions that are not of this kind.
    pub(crate) fn new(convolution: &Convolution, output: MapShape, shapes: &[MapShape], lanes: usize) -> Option<Self> {
        let (filters, first) = (&convolution.filters, convolution.inputs[0]);
        let (kernel, border, pitch) = (filters.kernel, filters.kernel / 2, padded(filters.biases.len()));
        let (places, inputs) = channels(convolution, shapes);
        let is_alike = |input: &Input| (input.factor, input.cropped) == (first.factor, first.cropped);
        let summed = 36 * inputs * pitch * first.factor * first.factor;
        let is_summed =
            convolution.inputs.iter().all(is_alike) && summed <= MOST_SUMMED && first.cropped[0] < first.factor;
        let factor = if is_summed { first.factor } else { 1 };
        if convolution.stride > 1 || kernel == 1 || border > factor {
            return None;
        }
        let outputs = factor * factor * pitch;
        // Products of a tile's side, with their matrices' way from memory if they are large.
        let [height, width] = [output.height, output.width].map(|side| side.div_ceil(factor));
        let cost = |tile: usize| {
            let points = (tile + 2) * (tile + 2);
            let waiting = if points * inputs * outputs > MOST_OWN {
                ROWS_PER_MATRIX
            } else {
                0
            };
            points * (height.div_ceil(tile) * width.div_ceil(tile) + waiting)
        };
        let tile = if cost(2) < cost(4) { 2 } else { 4 };
        let g: &[[f64; 3]] = if tile == 2 { &G2 } else { &G4 };
        let points = g.len() * g.len();
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
                // (g G^T)^T, then G times that.
                let dot = |a: &[f64; 3], b: [f64; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
                for (point, packed) in at_points.iter_mut().enumerate() {
                    let column = filter.map(|row| dot(&g[point % g.len()], row));
                    packed.set(input, kind * pitch + output, dot(&g[point / g.len()], column) as f32);
                }
            }
        }
        let across = width.div_ceil(tile);
        let is_shared = points * inputs * outputs > MOST_OWN;
        let tiles = if is_shared {
            MOST_BETWEEN / (points * (inputs + outputs))
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
        let (rows, missing) = self.rows_of_unit(&layer.convolution);
        let units = 0..(layer.output.height + missing).div_ceil(rows);
        if self.is_shared {
            let mut team = [(); MOST_THREADS];
            self.make(arch, layer, maps, &mut team[..scratches.len()], shared, units, out);
            return;
        }
        let lengths = [rows * layer.row(), missing * layer.row()];
        in_bands(scratches, units, out, lengths, &|scratch, units, out| {
            self.make(arch, layer, maps, &mut [()], scratch, units, out);
        });
    }

    /// Makes the units `units` of the output, `out`, with as many threads as `team` has members.
    fn make(
        &self,
        arch: Arch,
        layer: &Layer,
        maps: Maps<'_>,
        team: &mut [()],
        scratch: &mut Scratch,
        units: Range<usize>,
        out: &mut [f32],
    ) {
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
                &mut read[..tiles.len() * length],
                [length, 0],
                &|_, tiles, read| match self.tile {
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
            in_bands(team, 0..self.points(), products, [length, 0], &|_, points, products| {
                arch.dispatch(Multiply {
                    winograd: self,
                    points,
                    tiles: tiles.len(),
                    read,
                    products,
                });
            });
            let made = self.rows_made(layer, chunk.clone());
            let out = &mut out[(made.start - first_row) * row..(made.end - first_row) * row];
            let lengths = [rows * row, if start == 0 { missing * row } else { 0 }];
            let products = &*products;
            in_bands(team, chunk.clone(), out, lengths, &|_, units, out| {
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

fn odd_lines(numbers: usize) -> usize {
    let lines = numbers.div_ceil(BLOCK);
    (lines + 1 - lines % 2) * BLOCK
}

/// Takes what the tiles `tiles` read to the points: `read` [tile, point, channel].
struct ToPoints<'a, const TILE: usize, const READ: usize> {
    winograd: &'a Winograd,
    layer: &'a Layer,
    maps: Maps<'a>,
    tiles: Range<usize>,
    read: &'a mut [f32],
}

impl<const TILE: usize, const READ: usize> WithSimd for ToPoints<'_, TILE, READ> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self {
            winograd,
            layer,
            maps,
            tiles,
            read,
        } = self;
        let zero = simd.splat_f32s(0.0);
        let (across, point_pitch) = (winograd.across, winograd.input_pitch());
        let mut first_channel = 0;
        for input in &layer.convolution.inputs {
            let map = maps.view(input.map);
            let pitch = map.pitch();
            // Where the up-sampling comes later, rows that are cropped are read too.
            let ([height, width], factor, top) = match winograd.factor {
                1 => (input.size(map.shape), input.factor, input.cropped[0]),
                _ => ([map.shape.height, map.shape.width], 1, 0),
            };
            for (tile, read) in tiles.clone().zip(read.chunks_exact_mut(READ * READ * point_pitch)) {
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
                            let at = (i * READ + j) * point_pitch + first_channel + channel;
                            S::as_mut_simd_f32s(&mut read[at..at + S::F32_LANES]).0[0] = value;
                        }
                    }
                }
            }
            first_channel += pitch;
        }
    }
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

/// Takes the sums at the points back to the places of the tiles in the units `units` and finishes them; `products` begin with the
/// tile `first_tile`.
struct ToPlaces<'a, const TILE: usize, const READ: usize> {
    winograd: &'a Winograd,
    layer: &'a Layer,
    maps: Maps<'a>,
    units: Range<usize>,
    first_tile: usize,
    products: &'a [f32],
    out: &'a mut [f32],
}

impl<const TILE: usize, const READ: usize> WithSimd for ToPlaces<'_, TILE, READ> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self {
            winograd,
            layer,
            maps,
            units,
            first_tile,
            products,
            out,
        } = self;
        let MapShape {
            channels,
            height,
            width,
        } = layer.output;
        let (across, factor, pitch) = (winograd.across, winograd.factor, padded(channels));
        let (outputs, point_pitch) = (winograd.outputs, winograd.point_pitch());
        let (_, top) = winograd.rows_of_unit(&layer.convolution);
        let first_row = winograd.rows_made(layer, units.clone()).start;
        let zero = simd.splat_f32s(0.0);
        for tile in units.start * across..units.end * across {
            let (tile_row, tile_column) = (TILE * (tile / across), TILE * (tile % across));
            for kind in 0..factor * factor {
                for channel in (0..pitch).step_by(S::F32_LANES) {
                    let mut rows = [[zero; READ]; TILE];
                    for j in 0..READ {
                        let mut column = [zero; READ];
                        for (i, number) in column.iter_mut().enumerate() {
                            let place = (tile - first_tile) * outputs + kind * pitch + channel;
                            *number = vector::<S>(products, (i * READ + j) * point_pitch + place);
                        }
                        let column: [S::f32s; TILE] = to_places(simd, column);
                        for (row, value) in rows.iter_mut().zip(column) {
                            row[j] = value;
                        }
                    }
                    for (i, row) in rows.into_iter().enumerate() {
                        let y = (factor * (tile_row + i) + kind / factor).checked_sub(top);
                        let Some(y) = y.filter(|&y| y < height) else {
                            continue;
                        };
                        let row: [S::f32s; TILE] = to_places(simd, row);
                        for (j, sums) in row.into_iter().enumerate() {
                            let x = factor * (tile_column + j) + kind % factor;
                            if x < width {
                                let value = layer.finished(simd, sums, layer.added(&maps, y, x), channel);
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

/// B^T: a row or column of what a tile reads, at the points.
#[inline(always)]
fn to_points<S: Simd, const READ: usize>(simd: S, d: [S::f32s; READ]) -> [S::f32s; READ] {
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

/// A^T: sums at the points of a row or column, at the tile's places.
#[inline(always)]
fn to_places<S: Simd, const TILE: usize, const READ: usize>(simd: S, m: [S::f32s; READ]) -> [S::f32s; TILE] {
    let mut places = [m[0]; TILE];
    let (a, b) = (simd.add_f32s(m[1], m[2]), simd.sub_f32s(m[1], m[2]));
    if TILE == 2 {
        places[0] = simd.add_f32s(m[0], a);
        places[1] = simd.add_f32s(b, m[3]);
        return places;
    }
    let (c, d) = (simd.add_f32s(m[3], m[4]), simd.sub_f32s(m[3], m[4]));
    places[0] = simd.add_f32s(simd.add_f32s(m[0], a), c);
    places[1] = plus(simd, b, 2.0, d);
    places[2] = plus(simd, a, 4.0, c);
    places[3] = simd.add_f32s(plus(simd, b, 8.0, d), m[5]);
    places
}

/// a + factor b
#[inline(always)]
fn plus<S: Simd>(simd: S, a: S::f32s, factor: f32, b: S::f32s) -> S::f32s {
    simd.mul_add_e_f32s(simd.splat_f32s(factor), b, a)
}
