//! Convolutions of any side and stride as they are written.

use super::buffer::padded;
use super::layer::{Channels, Layer, Maps, Scratch};
use super::product::{Packed, Rows, Sink, multiply};
use crate::plan::{Convolution, Filters, MapShape};
use pulp::Simd;
use std::ops::Range;

pub(crate) struct Direct {
    /// [row of the kernel, column of the kernel, input channel] x outputs.
    filters: Packed,
    inputs: usize,
    kernel: usize,
}

/// Finishes the sums of places.
struct Finish<'a> {
    layer: &'a Layer,
    maps: &'a Maps<'a>,
    first_row: usize,
    out: &'a mut [f32],
}

impl<S: Simd> Sink<S> for Finish<'_> {
    #[inline(always)]
    fn store(&mut self, simd: S, place: usize, output: usize, sums: &[S::f32s]) {
        let (width, pitch) = (self.layer.output.width, padded(self.layer.output.channels));
        let (row, column) = (self.first_row + place / width, place % width);
        let (to, _) = S::as_mut_simd_f32s(&mut self.out[place * pitch + output..]);
        for (v, (to, &sums)) in to.iter_mut().zip(sums).enumerate() {
            let at = [row, column, output + v * S::F32_LANES];
            *to = self.layer.finished(simd, self.maps, sums, at);
        }
    }
}

impl Direct {
    pub(crate) fn new(filters: &Filters, channels: &Channels, lanes: usize) -> Self {
        let (inputs, outputs) = (channels.padded, padded(filters.biases.len()));
        let places = filters.kernel * filters.kernel;
        // One place is read as it lies; the padding behind its last channel is not read.
        let read = if places == 1 {
            channels.places.last().map_or(0, |last| last + 1)
        } else {
            places * inputs
        };
        let mut packed = Packed::new(read, outputs, lanes);
        for (index, filter) in filters.weights.chunks_exact(places).enumerate() {
            let (output, input) = (index / filters.inputs, channels.places[index % filters.inputs]);
            for (place, &value) in filter.iter().enumerate() {
                packed.set(place * inputs + input, output, value);
            }
        }
        Self {
            filters: packed,
            inputs,
            kernel: filters.kernel,
        }
    }

    /// Whether the input is read where it lies.
    fn reads_in_place(&self, convolution: &Convolution) -> bool {
        self.kernel == 1 && convolution.inputs.len() == 1
    }

    /// Numbers of the padded input rows of `units` output rows.
    pub(crate) fn scratch(&self, convolution: &Convolution, input: MapShape, units: usize) -> usize {
        if self.reads_in_place(convolution) {
            return 0;
        }
        let rows = convolution.stride * units.saturating_sub(1) + self.kernel;
        rows * (input.width + self.kernel - 1) * self.inputs
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
        let convolution = &layer.convolution;
        let (stride, width) = (convolution.stride, layer.output.width);
        let first = maps.view(convolution.inputs[0].map);
        let mut finish = Finish {
            layer,
            maps,
            first_row: units.start,
            out,
        };
        let count = units.len() * width;
        if self.reads_in_place(convolution) {
            let line = stride * first.shape.width * self.inputs;
            let rows = Rows {
                values: &first.values[units.start * line..],
                count,
                across: width,
                step: stride * self.inputs,
                line,
                parts: 1,
                pitch: 0,
            };
            if convolution.inputs[0].rectified {
                multiply::<S, true>(simd, &rows, &self.filters, &mut finish);
            } else {
                multiply::<S, false>(simd, &rows, &self.filters, &mut finish);
            }
            return;
        }
        let row = (first.shape.width + self.kernel - 1) * self.inputs;
        self.read(simd, layer, maps, units.clone(), scratch.read.values_mut());
        let rows = Rows {
            values: scratch.read.values(),
            count,
            across: width,
            step: stride * self.inputs,
            line: stride * row,
            parts: self.kernel,
            pitch: row,
        };
        multiply::<S, false>(simd, &rows, &self.filters, &mut finish);
    }

    /// The input rows of the output rows `units` with a border of zeros: `read` [rows, columns, channels].
    #[inline(always)]
    fn read<S: Simd>(&self, simd: S, layer: &Layer, maps: &Maps<'_>, units: Range<usize>, read: &mut [f32]) {
        let convolution = &layer.convolution;
        let zero = simd.splat_f32s(0.0);
        let border = self.kernel / 2;
        let shape = maps.view(convolution.inputs[0].map).shape;
        let row = (shape.width + self.kernel - 1) * self.inputs;
        let rows = convolution.stride * units.len().saturating_sub(1) + self.kernel;
        for (r, to) in read.chunks_exact_mut(row).take(rows).enumerate() {
            let y = (convolution.stride * units.start + r).wrapping_sub(border);
            if y >= shape.height {
                to.fill(0.0);
                continue;
            }
            let (inner, outer) = (border * self.inputs, (border + shape.width) * self.inputs);
            to[..inner].fill(0.0);
            to[outer..].fill(0.0);
            let mut first_channel = 0;
            for input in &convolution.inputs {
                let map = maps.view(input.map);
                let pitch = map.pitch();
                let from = &map.values[y * shape.width * pitch..][..shape.width * pitch];
                for (to, from) in to[inner..outer]
                    .chunks_exact_mut(self.inputs)
                    .zip(from.chunks_exact(pitch))
                {
                    let (to, _) = S::as_mut_simd_f32s(&mut to[first_channel..first_channel + pitch]);
                    for (to, &from) in to.iter_mut().zip(S::as_simd_f32s(from).0) {
                        *to = if input.rectified {
                            simd.max_f32s(zero, from)
                        } else {
                            from
                        };
                    }
                }
                first_channel += pitch;
            }
        }
    }
}
