//! Maps in memory.

use crate::plan::MapShape;

/// Channels of a map are padded with zeros to multiples of this: the widest vector of any processor.
pub(crate) const BLOCK: usize = 16;

/// Bytes of a cache line. Memory begins at one: then no vector crosses two.
const LINE: usize = 64;

/// Numbers from the beginning of a cache line on.
#[derive(Debug, Default)]
pub struct Buffer {
    values: Vec<f32>,
    first: usize,
    length: usize,
}

impl Buffer {
    /// Zeros.
    pub fn new(length: usize) -> Self {
        let values = vec![0.0; length + LINE / size_of::<f32>()];
        let first = values.as_ptr().align_offset(LINE).min(values.len() - length);
        Self { values, first, length }
    }

    /// The numbers.
    pub fn values(&self) -> &[f32] {
        &self.values[self.first..self.first + self.length]
    }

    /// The numbers, to write.
    pub fn values_mut(&mut self) -> &mut [f32] {
        &mut self.values[self.first..self.first + self.length]
    }
}

/// Channels with their padding.
pub fn padded(channels: usize) -> usize {
    channels.next_multiple_of(BLOCK)
}

/// A map's memory: rows of places, the padded channels of a place side by side.
#[derive(Clone, Copy)]
pub(crate) struct MapView<'a> {
    pub(crate) shape: MapShape,
    pub(crate) values: &'a [f32],
}

impl MapView<'_> {
    /// Numbers of a place.
    pub(crate) fn pitch(&self) -> usize {
        padded(self.shape.channels)
    }
}
