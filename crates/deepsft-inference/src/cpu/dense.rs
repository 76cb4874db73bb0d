//! Dense layers: a matrix and one row of numbers. Each weight is read once, so memory sets the pace.

use super::layout::{AlignedBuffer, BLOCK, padded_channels};
use crate::plan::{DenseLayer, MapId, MapShape};
use pulp::{Simd, WithSimd};
use std::ops::Range;

/// A dense layer that is ready to run.
#[derive(Debug)]
pub(crate) struct PackedDense {
    pub(crate) map: MapId,
    /// [block of outputs][position, padded channel][output]
    weights: AlignedBuffer,
    biases: AlignedBuffer,
    rectified: bool,
}

impl PackedDense {
    /// Packs `dense`, which reads one of the maps with these `shapes`.
    pub(crate) fn new(dense: DenseLayer, shapes: &[MapShape]) -> Self {
        let shape = shapes[dense.map.0];
        let (pitch, positions) = (padded_channels(shape.channels), shape.area());
        let outputs = dense.biases.len();
        let mut biases = AlignedBuffer::new(padded_channels(outputs));
        biases.values_mut()[..outputs].copy_from_slice(&dense.biases);
        let inputs = pitch * positions;
        let mut weights = AlignedBuffer::new(inputs * padded_channels(outputs));
        let packed = weights.values_mut();
        for (index, row) in dense.weights.chunks_exact(outputs).enumerate() {
            let input = index % positions * pitch + index / positions;
            for (block, row) in row.chunks(BLOCK).enumerate() {
                packed[(block * inputs + input) * BLOCK..][..row.len()].copy_from_slice(row);
            }
        }
        Self {
            map: dense.map,
            weights,
            biases,
            rectified: dense.rectified,
        }
    }

    /// Blocks of outputs.
    pub(crate) fn blocks(&self) -> usize {
        self.biases.values().len() / BLOCK
    }
}

/// The blocks `blocks` of a dense layer's result, `out`, from the map's values, `read`.
pub(crate) struct DenseBlocks<'a> {
    pub(crate) dense: &'a PackedDense,
    pub(crate) read: &'a [f32],
    pub(crate) blocks: Range<usize>,
    pub(crate) out: &'a mut [f32],
}

impl WithSimd for DenseBlocks<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        // Rows of weights that are summed apart, so that no sum waits for the one before.
        match S::F32_LANES {
            16.. => self.sum::<S, 1, 8>(simd),
            8 => self.sum::<S, 2, 4>(simd),
            4 => self.sum::<S, 4, 2>(simd),
            2 => self.sum::<S, 8, 1>(simd),
            _ => self.sum::<S, 16, 1>(simd),
        }
    }
}

impl DenseBlocks<'_> {
    #[inline(always)]
    fn sum<S: Simd, const VECTORS: usize, const ROWS: usize>(self, simd: S) {
        let (dense, read) = (self.dense, self.read);
        let zero = simd.splat_f32s(0.0);
        for (out, block) in self.out.chunks_exact_mut(BLOCK).zip(self.blocks) {
            let weights = &dense.weights.values()[block * read.len() * BLOCK..][..read.len() * BLOCK];
            let (weights, _) = S::as_simd_f32s(weights);
            let mut sums = [[zero; VECTORS]; ROWS];
            // A position has a multiple of `BLOCK` numbers.
            for (numbers, weights) in read.chunks_exact(ROWS).zip(weights.chunks_exact(ROWS * VECTORS)) {
                for (row, sums) in sums.iter_mut().enumerate() {
                    let number = simd.splat_f32s(numbers[row]);
                    for (v, sum) in sums.iter_mut().enumerate() {
                        *sum = simd.mul_add_e_f32s(number, weights[row * VECTORS + v], *sum);
                    }
                }
            }
            let (biases, _) = S::as_simd_f32s(&dense.biases.values()[block * BLOCK..][..BLOCK]);
            let (out, _) = S::as_mut_simd_f32s(out);
            for (v, (out, &bias)) in out.iter_mut().zip(biases).enumerate() {
                let mut value = bias;
                for sums in &sums {
                    value = simd.add_f32s(value, sums[v]);
                }
                if dense.rectified {
                    value = simd.max_f32s(zero, value);
                }
                *out = value;
            }
        }
    }
}
