//! Convolutions of any side and stride as they are written.

use super::buffer::{BLOCK, padded};
use super::layer::{Layer, Maps, Scratch};
use super::product::{Packed, Rows, Sink, multiply};
use crate::plan::{Convolution, MapShape};
use pulp::Simd;
use std::ops::Range;

pub(crate) struct Direct {
    /// [row of the kernel, column of the kernel, input channel] x outputs.
    filters: Packed,
    /// Numbers that are read of each place.
    inputs: usize,
    kernel: usize,
    /// Whether these are the channels without their padding: where there are few.
    unpadded: bool,
}

/// Adds the sums of places to what is there before: the biases and what is added.
struct Finish<'a> {
    layer: &'a Layer,
    maps: &'a Maps<'a>,
    first_row: usize,
    out: &'a mut [f32],
}

impl<S: Simd> Sink<S> for Finish<'_> {
    #[inline(always)]
    fn begin(&mut self, simd: S, places: Range<usize>) {
        let (width, pitch) = (self.layer.output.width, padded(self.layer.output.channels));
        let (biases, _) = S::as_simd_f32s(self.layer.biases.values());
        let out = &mut self.out[places.start * pitch..places.end * pitch];
        for (place, out) in places.zip(out.chunks_exact_mut(pitch)) {
            let (out, _) = S::as_mut_simd_f32s(out);
            out.copy_from_slice(biases);
            let added = self
                .layer
                .added(self.maps, self.first_row + place / width, place % width);
            for (out, &added) in out.iter_mut().zip(S::as_simd_f32s(added).0) {
                *out = simd.add_f32s(*out, added);
            }
        }
    }

    #[inline(always)]
    fn store(&mut self, simd: S, place: usize, output: usize, sums: &[S::f32s]) {
        let pitch = padded(self.layer.output.channels);
        let (to, _) = S::as_mut_simd_f32s(&mut self.out[place * pitch + output..]);
        for (to, &sums) in to.iter_mut().zip(sums) {
            let sums = simd.add_f32s(*to, sums);
            *to = match self.layer.convolution.rectified {
                true => simd.max_f32s(simd.splat_f32s(0.0), sums),
                false => sums,
            };
        }
    }
}

impl Direct {
    pub(crate) fn new(convolution: &Convolution, shapes: &[MapShape], lanes: usize) -> Self {
        let filters = &convolution.filters;
        let area = filters.kernel * filters.kernel;
        let unpadded = area > 1 && filters.inputs < BLOCK;
        let (mut places, mut inputs) = channels(convolution, shapes);
        if unpadded {
            (places, inputs) = ((0..filters.inputs).collect(), filters.inputs);
        }
        // One place is read as it lies; the padding behind its last channel is not read.
        let read = match area {
            1 => places.last().map_or(0, |last| last + 1),
            _ => area * inputs,
        };
        let mut packed = Packed::new(read, padded(filters.biases.len()), lanes);
        for (index, filter) in filters.weights.chunks_exact(area).enumerate() {
            let (output, input) = (index / filters.inputs, places[index % filters.inputs]);
            for (place, &value) in filter.iter().enumerate() {
                packed.set(place * inputs + input, output, value);
            }
        }
        Self {
            filters: packed,
            inputs,
            kernel: filters.kernel,
            unpadded,
        }
    }

    /// Whether the input is read where it lies.
    fn reads_in_place(&self, convolution: &Convolution) -> bool {
        self.kernel == 1 && convolution.inputs.len() == 1 && convolution.inputs[0].factor == 1
    }

    /// Numbers of the padded input rows, `width` long without the padding, of `rows` output rows.
    pub(crate) fn scratch(&self, convolution: &Convolution, width: usize, rows: usize) -> usize {
        if self.reads_in_place(convolution) {
            return 0;
        }
        let rows = convolution.stride * rows.saturating_sub(1) + self.kernel;
        rows * (width + self.kernel - 1) * self.inputs
    }

    /// Makes the rows `made` of the output; `out` begins with them.
    #[inline(always)]
    pub(crate) fn run<S: Simd>(
        &self,
        simd: S,
        layer: &Layer,
        maps: &Maps<'_>,
        scratch: &mut Scratch,
        made: Range<usize>,
        out: &mut [f32],
    ) {
        let convolution = &layer.convolution;
        let (stride, width) = (convolution.stride, layer.output.width);
        let input = convolution.inputs[0];
        let first = maps.view(input.map);
        let in_place = self.reads_in_place(convolution);
        let (values, parts, row) = if in_place {
            let row = first.shape.width * self.inputs;
            (&first.values[(stride * made.start + input.cropped[0]) * row..], 1, row)
        } else {
            self.read(simd, layer, maps, made.clone(), scratch.read.values_mut());
            let [_, columns] = input.size(first.shape);
            (
                scratch.read.values(),
                self.kernel,
                (columns + self.kernel - 1) * self.inputs,
            )
        };
        let rows = Rows {
            values,
            count: made.len() * width,
            across: width,
            step: stride * self.inputs,
            line: stride * row,
            parts,
            pitch: row,
        };
        let mut finish = Finish {
            layer,
            maps,
            first_row: made.start,
            out,
        };
        if in_place && input.rectified {
            multiply::<S, true>(simd, &rows, &self.filters, &mut finish);
        } else {
            multiply::<S, false>(simd, &rows, &self.filters, &mut finish);
        }
    }

    /// The input rows of the output rows `made` with a border of zeros: `read` [rows, columns, channels].
    #[inline(always)]
    fn read<S: Simd>(&self, simd: S, layer: &Layer, maps: &Maps<'_>, made: Range<usize>, read: &mut [f32]) {
        let convolution = &layer.convolution;
        let zero = simd.splat_f32s(0.0);
        let border = self.kernel / 2;
        let first = convolution.inputs[0];
        let [height, width] = first.size(maps.view(first.map).shape);
        let row = (width + self.kernel - 1) * self.inputs;
        let rows = convolution.stride * made.len().saturating_sub(1) + self.kernel;
        for (r, to) in read.chunks_exact_mut(row).take(rows).enumerate() {
            let y = (convolution.stride * made.start + r).wrapping_sub(border);
            if y >= height {
                to.fill(0.0);
                continue;
            }
            let (inner, outer) = (border * self.inputs, (border + width) * self.inputs);
            to[..inner].fill(0.0);
            to[outer..].fill(0.0);
            let mut first_channel = 0;
            for input in &convolution.inputs {
                let map = maps.view(input.map);
                let pitch = map.pitch();
                let from = (y + input.cropped[0]) / input.factor * map.shape.width * pitch;
                let from = &map.values[from..][..map.shape.width * pitch];
                let channels = if self.unpadded { map.shape.channels } else { pitch };
                for (to, from) in to[inner..outer]
                    .chunks_exact_mut(input.factor * self.inputs)
                    .zip(from.chunks_exact(pitch))
                {
                    for to in to.chunks_exact_mut(self.inputs) {
                        let to = &mut to[first_channel..first_channel + channels];
                        if self.unpadded {
                            for (to, &from) in to.iter_mut().zip(from) {
                                *to = if input.rectified && from < 0.0 { 0.0 } else { from };
                            }
                            continue;
                        }
                        let (to, _) = S::as_mut_simd_f32s(to);
                        for (to, &from) in to.iter_mut().zip(S::as_simd_f32s(from).0) {
                            *to = if input.rectified {
                                simd.max_f32s(zero, from)
                            } else {
                                from
                            };
                        }
                    }
                }
                first_channel += channels;
            }
        }
    }
}

/// The padded channels of the filters' channels, and their number: inputs are padded map by map.
pub(crate) fn channels(convolution: &Convolution, shapes: &[MapShape]) -> (Vec<usize>, usize) {
    let (mut places, mut first) = (Vec::new(), 0);
    for input in &convolution.inputs {
        let channels = shapes[input.map.0].channels;
        places.extend(first..first + channels);
        first += padded(channels);
    }
    (places, first)
}
