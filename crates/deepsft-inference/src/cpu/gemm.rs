//! Matrix products (GEMM): rows of numbers times a packed matrix, with all sums in registers.

use super::layout::{AlignedBuffer, BLOCK};
use pulp::{Arch, Simd, WithSimd};
use std::ops::Range;

/// Vectors of a panel: outputs that are summed at once, for vectors of `lanes` numbers: 32 outputs where they are long, 16 elsewhere.
const fn vectors(lanes: usize) -> usize {
    match lanes {
        8.. => 2,
        _ => BLOCK / lanes,
    }
}

/// Returns the length of this processor's vectors, in numbers.
pub fn vector_width(arch: Arch) -> usize {
    struct Width;
    impl WithSimd for Width {
        type Output = usize;

        #[inline(always)]
        fn with_simd<S: Simd>(self, _: S) -> usize {
            S::F32_LANES
        }
    }
    arch.dispatch(Width)
}

/// A matrix [inner, outputs] in the order in which [`multiply`] reads it: panels of outputs, the outputs of an inner index side by side.
#[derive(Debug)]
pub struct PackedMatrix {
    values: AlignedBuffer,
    inner: usize,
    outputs: usize,
    /// Outputs of a panel.
    panel: usize,
}

impl PackedMatrix {
    /// Makes a matrix of zeros for vectors of `width` numbers ([`vector_width`]). `outputs` is a multiple of 16.
    pub fn new(inner: usize, outputs: usize, width: usize) -> Self {
        Self {
            values: AlignedBuffer::new(inner * outputs),
            inner,
            outputs,
            panel: vectors(width) * width,
        }
    }

    /// Sets the number at (`inner`, `output`).
    pub fn set(&mut self, inner: usize, output: usize, value: f32) {
        let at = self.index(inner, output);
        self.values.values_mut()[at] = value;
    }

    /// Returns the index in [`Self::values_mut`] of the number at (`inner`, `output`); the outputs up to the next multiple of 16 follow it.
    pub fn index(&self, inner: usize, output: usize) -> usize {
        let first = output / self.panel * self.panel;
        let width = self.panel.min(self.outputs - first);
        first * self.inner + inner * width + output - first
    }

    /// Returns the numbers in packed order, to write.
    pub fn values_mut(&mut self) -> &mut [f32] {
        self.values.values_mut()
    }
}

/// The left matrix of a product: rows that lie in memory as the positions of an image do.
#[derive(Debug)]
pub struct MatrixRows<'a> {
    /// Numbers from the first row on.
    pub values: &'a [f32],
    /// Number of rows.
    pub count: usize,
    /// Rows side by side before the next line begins.
    pub across: usize,
    /// Numbers from one row to the next.
    pub step: usize,
    /// Numbers from one line to the next.
    pub line: usize,
    /// Parts of a row; together they are as long as the matrix's inner side.
    pub parts: usize,
    /// Numbers from one part to the next.
    pub pitch: usize,
}

impl MatrixRows<'_> {
    #[inline(always)]
    fn start(&self, row: usize) -> usize {
        row / self.across * self.line + row % self.across * self.step
    }
}

/// Stores the sums of a product. No closure: those are not compiled for the processor's vectors.
pub trait Epilogue<S: Simd> {
    /// Prepares for the sums of `rows`, which come next.
    fn begin(&mut self, simd: S, rows: Range<usize>);

    /// Stores sums of a row: vectors from `output` on.
    fn store(&mut self, simd: S, row: usize, output: usize, sums: &[S::f32s]);
}

/// Writes the sums as they are.
#[derive(Debug)]
pub struct Overwrite<'a> {
    /// The product: [row, output].
    pub values: &'a mut [f32],
    /// Outputs of a row, a multiple of 16.
    pub outputs: usize,
}

impl<S: Simd> Epilogue<S> for Overwrite<'_> {
    #[inline(always)]
    fn begin(&mut self, _: S, _: Range<usize>) {}

    #[inline(always)]
    fn store(&mut self, _: S, row: usize, output: usize, sums: &[S::f32s]) {
        let (to, _) = S::as_mut_simd_f32s(&mut self.values[row * self.outputs + output..]);
        to[..sums.len()].copy_from_slice(sums);
    }
}

/// Rows that are multiplied with all of a small matrix before the next ones: a multiple of every tile's rows.
const ROWS_TOGETHER: usize = 48;

/// Numbers of a matrix that stay in a core's cache.
const CACHED: usize = 1 << 16;

/// Multiplies `rows` by `matrix` and hands the sums to `epilogue`. `RELU` reads negative numbers of the rows as zero.
#[inline(always)]
pub fn multiply<S: Simd, const RELU: bool>(
    simd: S,
    rows: &MatrixRows<'_>,
    matrix: &PackedMatrix,
    epilogue: &mut impl Epilogue<S>,
) {
    let lanes = S::F32_LANES;
    // What is read again and again stays in the cache: the matrix, or else as many rows as fit.
    let together = match matrix.inner * matrix.outputs {
        ..=CACHED => ROWS_TOGETHER,
        _ => (2 * CACHED / matrix.inner).next_multiple_of(ROWS_TOGETHER),
    };
    for start in (0..rows.count).step_by(together) {
        let chosen = start..rows.count.min(start + together);
        epilogue.begin(simd, chosen.clone());
        for first in (0..matrix.outputs).step_by(matrix.panel) {
            let width = matrix.panel.min(matrix.outputs - first);
            let packed = &matrix.values.values()[first * matrix.inner..][..width * matrix.inner];
            let (packed, _) = S::as_simd_f32s(packed);
            let chosen = chosen.clone();
            // The sums, the vectors of the matrix and one number of a row have to fit into the registers: 32 of them, or 16.
            match (lanes, width / lanes) {
                (16.., 2) => tiles::<S, RELU, 8, 2>(simd, rows, chosen, packed, first, epilogue),
                (16.., _) => tiles::<S, RELU, 8, 1>(simd, rows, chosen, packed, first, epilogue),
                (8, _) => tiles::<S, RELU, 6, 2>(simd, rows, chosen, packed, first, epilogue),
                (4, _) if S::REGISTER_COUNT >= 32 => {
                    tiles::<S, RELU, 6, 4>(simd, rows, chosen, packed, first, epilogue)
                }
                (4, _) => tiles::<S, RELU, 2, 4>(simd, rows, chosen, packed, first, epilogue),
                (2, _) => tiles::<S, RELU, 2, 8>(simd, rows, chosen, packed, first, epilogue),
                _ => tiles::<S, RELU, 1, 16>(simd, rows, chosen, packed, first, epilogue),
            }
        }
    }
}

#[inline(always)]
fn tiles<S: Simd, const RELU: bool, const ROWS: usize, const VECTORS: usize>(
    simd: S,
    rows: &MatrixRows<'_>,
    chosen: Range<usize>,
    packed: &[S::f32s],
    output: usize,
    epilogue: &mut impl Epilogue<S>,
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
            epilogue.store(simd, first + r, output, sums);
        }
    }
}
