//! Winograd's F(4 x 4, 3 x 3) for a batch: a quarter of the multiplications. `deepsft-inference` explains the method.

use super::gradient_kernel::{GradientKernel, TOGETHER};
use super::padded_maps::PaddedMaps;
use super::scratch::with_scratch;
use deepsft_inference::gemm::{
    AlignedBuffer, InputLines, LineTransform, MatrixRows, OutputLines, Overwrite, PackedMatrix, both_ways, multiply,
    odd_cache_lines, padded_channels, plus, vector,
};
use pulp::{Arch, Simd, WithSimd};
use std::ops::Range;

/// Side of a tile.
pub const TILE: usize = 4;
/// Side of what a tile reads.
const READ: usize = TILE + 2;
const POINTS: usize = READ * READ;

/// Tiles that are taken through all three parts together: what lies between them stays in the cache.
pub const CHUNK: usize = 48;

/// Filters that are taken to the points together, and numbers of a cache line.
pub const BLOCK: usize = 16;

/// Filters of 3 x 3 at the points.
pub struct PointFilters {
    points: Vec<PackedMatrix>,
    /// Padded.
    outputs: usize,
}

impl PointFilters {
    /// Numbers that [`convolve`] needs between its parts.
    pub fn between(&self, from: &PaddedMaps) -> [usize; 2] {
        [
            CHUNK * POINTS * odd_cache_lines(from.pitch),
            POINTS * odd_cache_lines(CHUNK * self.outputs),
        ]
    }

    /// `weight` gives the number of an input, an output and one of the nine places.
    pub fn new(inputs: usize, outputs: usize, lanes: usize, weight: impl Fn(usize, usize, usize) -> f32) -> Self {
        let all = padded_channels(outputs);
        let mut points: Vec<PackedMatrix> = (0..POINTS).map(|_| PackedMatrix::new(inputs, all, lanes)).collect();
        for first in (0..outputs).step_by(BLOCK) {
            for input in 0..inputs {
                let place = points[0].index(input, first);
                let mut filters = [[0.0; BLOCK]; 9];
                for output in first..outputs.min(first + BLOCK) {
                    for (place, filters) in filters.iter_mut().enumerate() {
                        filters[output - first] = weight(input, output, place);
                    }
                }
                let [a, b, c, d, e, f, g, h, i] = filters;
                let columns = [[a, d, g], [b, e, h], [c, f, i]].map(filter_to_points);
                for row in 0..READ {
                    let row_at_points = filter_to_points(columns.map(|column| column[row]));
                    for (point, values) in points[row * READ..].iter_mut().zip(&row_at_points) {
                        point.values_mut()[place..place + BLOCK].copy_from_slice(values);
                    }
                }
            }
        }
        Self { points, outputs: all }
    }
}

/// G: a filter's row or column at the points.
fn filter_to_points([a, b, c]: [[f32; BLOCK]; 3]) -> [[f32; BLOCK]; READ] {
    let mut points = [a, a, a, a, a, c];
    for k in 0..BLOCK {
        let (outer, inner) = ((a[k] + c[k]) * (-1.0 / 6.0), b[k] * (1.0 / 6.0));
        let (coarse, fine) = (a[k] * (1.0 / 24.0) + c[k] * (1.0 / 6.0), b[k] * (1.0 / 12.0));
        points[0][k] = a[k] * 0.25;
        points[1][k] = outer - inner;
        points[2][k] = outer + inner;
        points[3][k] = coarse + fine;
        points[4][k] = coarse - fine;
    }
    points
}

/// Convolves some samples of `from`, whose border is one place, and whose sides without it are multiples of [`TILE`]:
/// `out` [sample, row, column, padded channel] with `size` rows and columns.
pub fn convolve(
    arch: Arch,
    from: &PaddedMaps,
    filters: &PointFilters,
    samples: Range<usize>,
    size: [usize; 2],
    between: [&mut [f32]; 2],
    out: &mut [f32],
) {
    let [read, products] = between;
    let [down, across] = size.map(|side| side.div_ceil(TILE));
    let tiles = samples.len() * down * across;
    for start in (0..tiles).step_by(CHUNK) {
        arch.dispatch(Chunk {
            from,
            filters,
            first_sample: samples.start,
            size,
            tiles: start..tiles.min(start + CHUNK),
            read,
            products,
            out,
        });
    }
}

struct Chunk<'a> {
    from: &'a PaddedMaps,
    filters: &'a PointFilters,
    first_sample: usize,
    size: [usize; 2],
    tiles: Range<usize>,
    read: &'a mut [f32],
    products: &'a mut [f32],
    out: &'a mut [f32],
}

impl WithSimd for Chunk<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let (from, tiles, [height, width]) = (self.from, self.tiles, self.size);
        let [down, across] = [height, width].map(|side| side.div_ceil(TILE));
        let pitch = odd_cache_lines(from.pitch);
        for (tile, read) in tiles.clone().zip(self.read.chunks_exact_mut(POINTS * pitch)) {
            let sample = from.of_sample(self.first_sample + tile / (down * across));
            let [y, x] = [tile / across % down, tile % across].map(|at| TILE * at);
            let first = &sample[y * from.row + x * from.pitch..];
            tile_to_points::<S, InputLines, READ>(simd, first, from, from.pitch, read, pitch);
        }
        let (outputs, products) = (self.filters.outputs, self.products);
        let point_pitch = odd_cache_lines(CHUNK * outputs);
        for (point, matrix) in self.filters.points.iter().enumerate() {
            let rows = MatrixRows {
                values: &self.read[point * pitch..],
                count: tiles.len(),
                across: tiles.len(),
                step: POINTS * pitch,
                line: 0,
                parts: 1,
                pitch: 0,
            };
            let values = &mut products[point * point_pitch..];
            multiply::<S, false>(simd, &rows, matrix, &mut Overwrite { values, outputs });
        }
        for (index, tile) in tiles.enumerate() {
            let out = &mut self.out[tile / (down * across) * height * width * outputs..][..height * width * outputs];
            let [y, x] = [tile / across % down, tile % across].map(|at| TILE * at);
            for channel in (0..outputs).step_by(S::F32_LANES) {
                let mut columns = [[simd.splat_f32s(0.0); READ]; READ];
                for (j, column) in columns.iter_mut().enumerate() {
                    for (i, number) in column.iter_mut().enumerate() {
                        *number = vector::<S>(products, (i * READ + j) * point_pitch + index * outputs + channel);
                    }
                }
                let columns = both_ways::<S, OutputLines, READ, TILE>(simd, columns);
                for i in 0..TILE.min(height - y) {
                    for (j, column) in columns.iter().enumerate().take(width - x) {
                        let at = ((y + i) * width + x + j) * outputs + channel;
                        S::as_mut_simd_f32s(&mut out[at..at + S::F32_LANES]).0[0] = column[i];
                    }
                }
            }
        }
    }
}

/// Takes the tile that begins at `first`, its first `channels` channels, to the points: `points` [point, channel].
#[inline(always)]
fn tile_to_points<S: Simd, M: LineTransform<SIDE, READ>, const SIDE: usize>(
    simd: S,
    first: &[f32],
    from: &PaddedMaps,
    channels: usize,
    points: &mut [f32],
    pitch: usize,
) {
    for channel in (0..channels).step_by(S::F32_LANES) {
        let mut numbers = [[simd.splat_f32s(0.0); SIDE]; SIDE];
        for (i, row) in numbers.iter_mut().enumerate() {
            for (j, number) in row.iter_mut().enumerate() {
                *number = vector::<S>(first, i * from.row + j * from.pitch + channel);
            }
        }
        let transformed = both_ways::<S, M, SIDE, READ>(simd, numbers);
        for (point, &value) in transformed.as_flattened().iter().enumerate() {
            let at = point * pitch + channel;
            S::as_mut_simd_f32s(&mut points[at..at + S::F32_LANES]).0[0] = value;
        }
    }
}

/// Sums of the filters' gradient over all tiles: [channel, place of the kernel, padded output] for the channels `channels`
/// of `read`, whose number is a multiple of [`BLOCK`].
pub fn filter_gradient(
    arch: Arch,
    read: &PaddedMaps,
    gradient: &PaddedMaps,
    size: [usize; 2],
    channels: Range<usize>,
) -> AlignedBuffer {
    let (count, outputs) = (channels.len(), gradient.pitch);
    let mut out = AlignedBuffer::new(count * 9 * outputs);
    let [reads, gradients] = [count, outputs].map(|numbers| POINTS * odd_cache_lines(CHUNK * numbers));
    with_scratch([reads, gradients, POINTS * count * outputs], |between| {
        arch.dispatch(FilterGradient {
            read,
            gradient,
            size,
            channels,
            between,
            out: out.values_mut(),
        });
    });
    out
}

struct FilterGradient<'a> {
    read: &'a PaddedMaps,
    gradient: &'a PaddedMaps,
    size: [usize; 2],
    channels: Range<usize>,
    between: [&'a mut [f32]; 3],
    out: &'a mut [f32],
}

impl WithSimd for FilterGradient<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let (read, gradient, [reads, gradients, sums]) = (self.read, self.gradient, self.between);
        let [down, across] = self.size.map(|side| side.div_ceil(TILE));
        let (count, outputs) = (self.channels.len(), gradient.pitch);
        // [point, tile, channel] and [point, channel, output].
        let [read_pitch, gradient_pitch] = [count, outputs].map(|numbers| odd_cache_lines(CHUNK * numbers));
        sums.fill(0.0);
        let tiles = read.samples() * down * across;
        for start in (0..tiles).step_by(CHUNK) {
            let chunk = start..tiles.min(start + CHUNK);
            for (index, tile) in chunk.clone().enumerate() {
                let sample = tile / (down * across);
                let [y, x] = [tile / across % down, tile % across].map(|at| TILE * at);
                let first = &read.of_sample(sample)[y * read.row + x * read.pitch + self.channels.start..];
                let points = &mut reads[index * count..];
                tile_to_points::<S, InputLines, READ>(simd, first, read, count, points, read_pitch);
                let first = &gradient.within(sample)[y * gradient.row + x * gradient.pitch..];
                let points = &mut gradients[index * outputs..];
                tile_to_points::<S, GradientLines, TILE>(simd, first, gradient, outputs, points, gradient_pitch);
            }
            for (point, sums) in sums.chunks_exact_mut(count * outputs).enumerate() {
                let (read, gradient) = (&reads[point * read_pitch..], &gradients[point * gradient_pitch..]);
                for (block, sums) in sums.chunks_exact_mut(TOGETHER * outputs).enumerate() {
                    let kernel = GradientKernel {
                        read: &read[block * TOGETHER..],
                        step: count,
                        line: 0,
                        gradient,
                        row: 0,
                        rows: 1,
                        columns: chunk.len(),
                        pitch: outputs,
                    };
                    kernel.add_to(simd, sums);
                }
            }
        }
        for (channel, out) in self.out.chunks_exact_mut(9 * outputs).enumerate() {
            for output in (0..outputs).step_by(S::F32_LANES) {
                let mut columns = [[simd.splat_f32s(0.0); READ]; READ];
                for (j, column) in columns.iter_mut().enumerate() {
                    for (i, number) in column.iter_mut().enumerate() {
                        *number = vector::<S>(sums, ((i * READ + j) * count + channel) * outputs + output);
                    }
                }
                let columns = both_ways::<S, FilterLines, READ, 3>(simd, columns);
                for (j, column) in columns.into_iter().enumerate() {
                    for (i, value) in column.into_iter().enumerate() {
                        let at = (3 * i + j) * outputs + output;
                        S::as_mut_simd_f32s(&mut out[at..at + S::F32_LANES]).0[0] = value;
                    }
                }
            }
        }
    }
}

/// A: takes a tile of the output's gradient to the points, the transpose of [`OutputLines`].
struct GradientLines;

impl LineTransform<TILE, READ> for GradientLines {
    #[inline(always)]
    fn line<S: Simd>(simd: S, [a, b, c, d]: [S::f32s; TILE]) -> [S::f32s; READ] {
        let (even, odd) = (simd.add_f32s(a, c), simd.add_f32s(b, d));
        let far_even = plus(simd, a, 4.0, c);
        let far_odd = plus(simd, simd.add_f32s(b, b), 8.0, d);
        [
            a,
            simd.add_f32s(even, odd),
            simd.sub_f32s(even, odd),
            simd.add_f32s(far_even, far_odd),
            simd.sub_f32s(far_even, far_odd),
            d,
        ]
    }
}

/// The transpose of G: takes sums at the points to the filter's gradient.
struct FilterLines;

impl LineTransform<READ, 3> for FilterLines {
    #[inline(always)]
    fn line<S: Simd>(simd: S, [a, b, c, d, e, f]: [S::f32s; READ]) -> [S::f32s; 3] {
        let (near, near_apart) = (simd.add_f32s(b, c), simd.sub_f32s(c, b));
        let (far, far_apart) = (simd.add_f32s(d, e), simd.sub_f32s(d, e));
        let scaled = simd.mul_f32s(simd.splat_f32s(1.0 / 6.0), near);
        let first = plus(simd, simd.mul_f32s(simd.splat_f32s(0.25), a), 1.0 / 24.0, far);
        let second = simd.mul_f32s(simd.splat_f32s(1.0 / 6.0), near_apart);
        [
            simd.sub_f32s(first, scaled),
            plus(simd, second, 1.0 / 12.0, far_apart),
            simd.sub_f32s(plus(simd, f, 1.0 / 6.0, far), scaled),
        ]
    }
}
