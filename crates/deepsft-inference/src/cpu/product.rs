//! The one kernel: a few rows of numbers times a packed matrix, all sums in registers.

use super::buffer::{BLOCK, Buffer};
use pulp::Simd;
use std::ops::Range;

/// Vectors of outputs that are summed at once, for vectors of `lanes` numbers: 32 outputs where they are long, 16 elsewhere.
const fn vectors(lanes: usize) -> usize {
    match lanes {
        8.. => 2,
        _ => BLOCK / lanes,
    }
}

/// Outputs that are summed at once.
fn group(lanes: usize) -> usize {
    vectors(lanes) * lanes
}

/// A matrix [inner, outputs] in the order in which the kernel reads it: groups of outputs, in a group the outputs of one inner index
/// side by side.
pub struct Packed {
    values: Buffer,
    inner: usize,
    outputs: usize,
    group: usize,
}

impl std::fmt::Debug for Packed {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Packed")
            .field("inner", &self.inner)
            .field("outputs", &self.outputs)
            .finish_non_exhaustive()
    }
}

impl Packed {
    /// A matrix of zeros; `outputs` is a multiple of 16.
    pub fn new(inner: usize, outputs: usize, lanes: usize) -> Self {
        Self {
            values: Buffer::new(inner * outputs),
            inner,
            outputs,
            group: group(lanes),
        }
    }

    /// Sets a number.
    pub fn set(&mut self, k: usize, output: usize, value: f32) {
        let at = self.place(k, output);
        self.values.values_mut()[at] = value;
    }

    /// Where a number lies. Those of the outputs up to the next multiple of 16 follow.
    pub fn place(&self, k: usize, output: usize) -> usize {
        let first = output / self.group * self.group;
        let width = self.group.min(self.outputs - first);
        first * self.inner + k * width + output - first
    }

    /// The numbers as they lie.
    pub fn values_mut(&mut self) -> &mut [f32] {
        self.values.values_mut()
    }
}

/// The rows of a product lie in `values` as places of an image do.
pub struct Rows<'a> {
    /// Numbers from the first row on.
    pub values: &'a [f32],
    /// Number of rows.
    pub count: usize,
    /// Rows side by side before the next line begins.
    pub across: usize,
    /// From one row to the next.
    pub step: usize,
    /// From one line to the next.
    pub line: usize,
    /// Parts of a row; together they are as long as the matrix's inner side.
    pub parts: usize,
    /// From one part to the next.
    pub pitch: usize,
}

impl std::fmt::Debug for Rows<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Rows")
            .field("count", &self.count)
            .finish_non_exhaustive()
    }
}

impl Rows<'_> {
    #[inline(always)]
    fn start(&self, row: usize) -> usize {
        row / self.across * self.line + row % self.across * self.step
    }
}

/// Takes the sums. No closure: those are not compiled for the processor's vectors.
pub trait Sink<S: Simd> {
    /// The sums of these rows come next.
    fn begin(&mut self, simd: S, rows: Range<usize>);

    /// Sums of a row: vectors from `output` on.
    fn store(&mut self, simd: S, row: usize, output: usize, sums: &[S::f32s]);
}

/// Rows that are multiplied with all of a small matrix before the next ones: a multiple of every tile's rows.
const ROWS_TOGETHER: usize = 48;

/// Numbers of a matrix that stay in a core's cache.
const SMALL: usize = 1 << 16;

/// The product of `rows` and `matrix`. `RELU` reads negative numbers of the rows as zero.
#[inline(always)]
pub fn multiply<S: Simd, const RELU: bool>(simd: S, rows: &Rows<'_>, matrix: &Packed, sink: &mut impl Sink<S>) {
    let lanes = S::F32_LANES;
    // What is read again and again stays in the cache: the matrix, or else as many rows as fit.
    let together = match matrix.inner * matrix.outputs {
        ..=SMALL => ROWS_TOGETHER,
        _ => (2 * SMALL / matrix.inner).next_multiple_of(ROWS_TOGETHER),
    };
    for start in (0..rows.count).step_by(together) {
        let chosen = start..rows.count.min(start + together);
        sink.begin(simd, chosen.clone());
        for first in (0..matrix.outputs).step_by(matrix.group) {
            let width = matrix.group.min(matrix.outputs - first);
            let packed = &matrix.values.values()[first * matrix.inner..][..width * matrix.inner];
            let (packed, _) = S::as_simd_f32s(packed);
            let chosen = chosen.clone();
            // The sums, the vectors of the matrix and one number of a row have to fit into the registers: 32 of them, or 16.
            match (lanes, width / lanes) {
                (16.., 2) => tiles::<S, RELU, 8, 2>(simd, rows, chosen, packed, first, sink),
                (16.., _) => tiles::<S, RELU, 8, 1>(simd, rows, chosen, packed, first, sink),
                (8, _) => tiles::<S, RELU, 6, 2>(simd, rows, chosen, packed, first, sink),
                (4, _) if S::REGISTER_COUNT >= 32 => tiles::<S, RELU, 6, 4>(simd, rows, chosen, packed, first, sink),
                (4, _) => tiles::<S, RELU, 2, 4>(simd, rows, chosen, packed, first, sink),
                (2, _) => tiles::<S, RELU, 2, 8>(simd, rows, chosen, packed, first, sink),
                _ => tiles::<S, RELU, 1, 16>(simd, rows, chosen, packed, first, sink),
            }
        }
    }
}

#[inline(always)]
fn tiles<S: Simd, const RELU: bool, const ROWS: usize, const VECTORS: usize>(
    simd: S,
    rows: &Rows<'_>,
    chosen: Range<usize>,
    packed: &[S::f32s],
    output: usize,
    sink: &mut impl Sink<S>,
) {
    let (packed, _) = packed.as_chunks::<VECTORS>();
    let part = packed.len() / rows.parts;
    for first in chosen.clone().step_by(ROWS) {
        // The last rows are done twice rather than by a kernel of their own.
        let mut starts = [0; ROWS];
        for (r, start) in starts.iter_mut().enumerate() {
            *start = rows.start((first + r).min(chosen.end - 1));
        }
        let mut sums = [[simd.splat_f32s(0.0); VECTORS]; ROWS];
        for p in 0..rows.parts {
            let packed = &packed[p * part..][..part];
            let mut row: [&[f32]; ROWS] = [&[]; ROWS];
            for (row, start) in row.iter_mut().zip(starts) {
                *row = &rows.values[start + p * rows.pitch..][..part];
            }
            for k in 0..part {
                for (sums, row) in sums.iter_mut().zip(row) {
                    // Not `max`: that is a call in WebAssembly.
                    let number = if RELU && row[k] < 0.0 { 0.0 } else { row[k] };
                    let number = simd.splat_f32s(number);
                    for (sum, &weight) in sums.iter_mut().zip(&packed[k]) {
                        *sum = simd.mul_add_e_f32s(number, weight, *sum);
                    }
                }
            }
        }
        for (r, sums) in sums.iter().enumerate().take(chosen.end - first) {
            sink.store(simd, first + r, output, sums);
        }
    }
}
