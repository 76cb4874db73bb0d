//! Maps in memory: rows of positions (NHWC), the channels of a position side by side and padded with zeros.

use crate::plan::{MapId, MapShape};
use pulp::Simd;

/// Channels of a map are padded to multiples of this: the widest vector of any processor.
pub(crate) const BLOCK: usize = 16;

/// Bytes of a cache line. Memory begins at one: then no vector crosses two.
const LINE: usize = 64;

/// Numbers whose memory begins at a cache line.
#[derive(Default)]
pub struct AlignedBuffer {
    values: Vec<f32>,
    first: usize,
    length: usize,
}

impl std::fmt::Debug for AlignedBuffer {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "AlignedBuffer({})", self.length)
    }
}

impl AlignedBuffer {
    /// Allocates `length` zeros.
    pub fn new(length: usize) -> Self {
        let values = vec![0.0; length + LINE / size_of::<f32>()];
        let first = values.as_ptr().align_offset(LINE).min(values.len() - length);
        Self { values, first, length }
    }

    /// Returns the numbers.
    pub fn values(&self) -> &[f32] {
        &self.values[self.first..self.first + self.length]
    }

    /// Returns the numbers, to write.
    pub fn values_mut(&mut self) -> &mut [f32] {
        &mut self.values[self.first..self.first + self.length]
    }
}

/// Returns the number of channels with their padding: the next multiple of 16.
pub fn padded_channels(channels: usize) -> usize {
    channels.next_multiple_of(BLOCK)
}

/// Rounds `numbers` up to an odd number of cache lines: what lies so far apart does not crowd in the cache.
pub fn odd_cache_lines(numbers: usize) -> usize {
    let lines = numbers.div_ceil(BLOCK);
    (lines + 1 - lines % 2) * BLOCK
}

/// A map in its memory.
#[derive(Clone, Copy)]
pub(crate) struct MapView<'a> {
    pub(crate) shape: MapShape,
    pub(crate) values: &'a [f32],
}

impl MapView<'_> {
    /// Numbers of a position.
    pub(crate) fn pitch(&self) -> usize {
        padded_channels(self.shape.channels)
    }
}

/// The maps of a plan while a layer runs.
#[derive(Clone, Copy)]
pub(crate) struct Maps<'a> {
    pub(crate) shapes: &'a [MapShape],
    pub(crate) slots: &'a [usize],
    pub(crate) buffers: &'a [AlignedBuffer],
}

impl<'a> Maps<'a> {
    pub(crate) fn view(&self, map: MapId) -> MapView<'a> {
        let shape = self.shapes[map.0];
        let length = shape.area() * padded_channels(shape.channels);
        let values = &self.buffers[self.slots[map.0]].values()[..length];
        MapView { shape, values }
    }
}

/// Working memory of a thread.
#[derive(Debug)]
pub(crate) struct Scratch {
    pub(crate) read: AlignedBuffer,
    pub(crate) products: AlignedBuffer,
}

/// Loads the vector of `values` from `at` on.
#[inline(always)]
pub fn vector<S: Simd>(values: &[f32], at: usize) -> S::f32s {
    S::as_simd_f32s(&values[at..at + S::F32_LANES]).0[0]
}
