//! Direct convolutions, of any kernel and stride.

use super::gemm::{Epilogue, MatrixRows, PackedMatrix, multiply};
use super::layer_spec::LayerRun;
use super::layout::{BLOCK, Scratch, padded_channels};
use super::team::{Chunks, in_parallel};
use crate::plan::{Convolution, MapShape};
use pulp::{Simd, WithSimd};
use std::ops::Range;

/// A convolution's filters as a matrix.
#[derive(Debug)]
pub(crate) struct Direct {
    /// [row of the kernel, column of the kernel, input channel] x outputs.
    filters: PackedMatrix,
    /// Numbers that are read of each position.
    inputs: usize,
    kernel: usize,
    /// Whether these are the channels without their padding: where there are few.
    unpadded: bool,
}

/// Adds the sums of positions to what is there before: the biases and the skip input.
struct Accumulate<'a> {
    layer: LayerRun<'a>,
    first_row: usize,
    out: &'a mut [f32],
}

impl<S: Simd> Epilogue<S> for Accumulate<'_> {
    #[inline(always)]
    fn begin(&mut self, simd: S, positions: Range<usize>) {
        let spec = self.layer.spec;
        let (width, pitch) = (spec.output.width, padded_channels(spec.output.channels));
        let (biases, _) = S::as_simd_f32s(spec.biases.values());
        let out = &mut self.out[positions.start * pitch..positions.end * pitch];
        for (position, out) in positions.zip(out.chunks_exact_mut(pitch)) {
            let (out, _) = S::as_mut_simd_f32s(out);
            out.copy_from_slice(biases);
            let skip = self.layer.skip(self.first_row + position / width, position % width);
            for (out, &skip) in out.iter_mut().zip(S::as_simd_f32s(skip).0) {
                *out = simd.add_f32s(*out, skip);
            }
        }
    }

    #[inline(always)]
    fn store(&mut self, simd: S, position: usize, output: usize, sums: &[S::f32s]) {
        let pitch = padded_channels(self.layer.spec.output.channels);
        let (to, _) = S::as_mut_simd_f32s(&mut self.out[position * pitch + output..]);
        for (to, &sums) in to.iter_mut().zip(sums) {
            let sums = simd.add_f32s(*to, sums);
            *to = match self.layer.spec.convolution.rectified {
                true => simd.max_f32s(simd.splat_f32s(0.0), sums),
                false => sums,
            };
        }
    }
}

impl Direct {
    pub(crate) fn new(convolution: &Convolution, shapes: &[MapShape], width: usize) -> Self {
        let filters = &convolution.filters;
        let area = filters.kernel * filters.kernel;
        let unpadded = area > 1 && filters.inputs < BLOCK;
        let (mut channels, mut inputs) = convolution.input_channels(shapes, padded_channels);
        if unpadded {
            (channels, inputs) = ((0..filters.inputs).collect(), filters.inputs);
        }
        // One position is read as it lies; the padding behind its last channel is not read.
        let read = match area {
            1 => channels.last().map_or(0, |last| last + 1),
            _ => area * inputs,
        };
        let mut packed = PackedMatrix::new(read, padded_channels(filters.biases.len()), width);
        for (index, filter) in filters.weights.chunks_exact(area).enumerate() {
            let (output, input) = (index / filters.inputs, channels[index % filters.inputs]);
            for (tap, &value) in filter.iter().enumerate() {
                packed.set(tap * inputs + input, output, value);
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

    /// Makes the rows `rows` of the output, `out`.
    pub(crate) fn run(&self, layer: LayerRun<'_>, scratches: &mut [Scratch], rows: Range<usize>, out: &mut [f32]) {
        let row = layer.spec.row();
        let out = Chunks::whole(&mut out[rows.start * row..rows.end * row], row);
        in_parallel(scratches, rows, out, &|scratch, rows, out| {
            layer.arch.dispatch(DirectRows {
                direct: self,
                layer,
                scratch,
                rows,
                out: out.values,
            });
        });
    }

    /// The input rows of the output rows `made` with a border of zeros: `read` [rows, columns, channels].
    #[inline(always)]
    fn read(&self, layer: LayerRun<'_>, made: Range<usize>, read: &mut [f32]) {
        let convolution = &layer.spec.convolution;
        let border = self.kernel / 2;
        let first = convolution.inputs[0];
        let [height, width] = first.size(layer.maps.view(first.map).shape);
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
                let map = layer.maps.view(input.map);
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
                        for (to, &from) in to.iter_mut().zip(from) {
                            *to = if input.rectified && from < 0.0 { 0.0 } else { from };
                        }
                    }
                }
                first_channel += channels;
            }
        }
    }
}

/// The rows `rows` of the output; `out` begins with them.
struct DirectRows<'a> {
    direct: &'a Direct,
    layer: LayerRun<'a>,
    scratch: &'a mut Scratch,
    rows: Range<usize>,
    out: &'a mut [f32],
}

impl WithSimd for DirectRows<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let (direct, layer) = (self.direct, self.layer);
        let (convolution, width) = (&layer.spec.convolution, layer.spec.output.width);
        let (stride, inputs) = (convolution.stride, direct.inputs);
        let input = convolution.inputs[0];
        let first = layer.maps.view(input.map);
        let in_place = direct.reads_in_place(convolution);
        let (values, parts, row) = if in_place {
            let row = first.shape.width * inputs;
            let start = (stride * self.rows.start + input.cropped[0]) * row;
            (&first.values[start..], 1, row)
        } else {
            let read = &mut self.scratch.read;
            direct.read(layer, self.rows.clone(), read.values_mut());
            let [_, columns] = input.size(first.shape);
            (read.values(), direct.kernel, (columns + direct.kernel - 1) * inputs)
        };
        let rows = MatrixRows {
            values,
            count: self.rows.len() * width,
            across: width,
            step: stride * inputs,
            line: stride * row,
            parts,
            pitch: row,
        };
        let mut epilogue = Accumulate {
            layer,
            first_row: self.rows.start,
            out: self.out,
        };
        if in_place && input.rectified {
            multiply::<S, true>(simd, &rows, &direct.filters, &mut epilogue);
        } else {
            multiply::<S, false>(simd, &rows, &direct.filters, &mut epilogue);
        }
    }
}
