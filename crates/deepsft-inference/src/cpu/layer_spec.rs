//! What both ways of convolving share: a layer's description, and what happens to its sums.

use super::layout::{AlignedBuffer, Maps, padded_channels, vector};
use crate::plan::{Convolution, MapShape};
use pulp::{Arch, Simd};

/// A convolution without its filters.
#[derive(Debug)]
pub(crate) struct LayerSpec {
    pub(crate) convolution: Convolution,
    pub(crate) output: MapShape,
    pub(crate) biases: AlignedBuffer,
}

/// A layer at work.
#[derive(Clone, Copy)]
pub(crate) struct LayerRun<'a> {
    pub(crate) arch: Arch,
    pub(crate) spec: &'a LayerSpec,
    pub(crate) maps: Maps<'a>,
}

impl LayerSpec {
    pub(crate) fn new(convolution: Convolution, output: MapShape) -> Self {
        let mut biases = AlignedBuffer::new(padded_channels(output.channels));
        biases.values_mut()[..output.channels].copy_from_slice(&convolution.filters.biases);
        Self {
            convolution,
            output,
            biases,
        }
    }

    /// Numbers of a row of the output.
    pub(crate) fn row(&self) -> usize {
        self.output.width * padded_channels(self.output.channels)
    }
}

impl<'a> LayerRun<'a> {
    /// Returns the skip input at a position and right of it; nothing where there is none.
    #[inline(always)]
    pub(crate) fn skip(&self, row: usize, column: usize) -> &'a [f32] {
        let Some(skip) = self.spec.convolution.skip else {
            return &[];
        };
        let map = self.maps.view(skip.map);
        let position = match skip.factor {
            1 => (row + skip.top) * map.shape.width + column,
            factor => (row + skip.top) / factor * map.shape.width + column / factor,
        };
        &map.values[position * map.pitch()..]
    }

    /// Adds bias and skip input to the vector of sums from `channel` on, and rectifies it.
    #[inline(always)]
    pub(crate) fn finished<S: Simd>(&self, simd: S, sums: S::f32s, skip: &[f32], channel: usize) -> S::f32s {
        let mut sums = simd.add_f32s(sums, vector::<S>(self.spec.biases.values(), channel));
        if !skip.is_empty() {
            sums = simd.add_f32s(sums, vector::<S>(skip, channel));
        }
        if self.spec.convolution.rectified {
            sums = simd.max_f32s(simd.splat_f32s(0.0), sums);
        }
        sums
    }
}
