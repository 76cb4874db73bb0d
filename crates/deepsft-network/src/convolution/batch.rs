//! Convolutions of a batch on the processor and their gradients, as products of matrices.
//!
//! The maps of a batch are brought into [`PaddedMaps`]: rows of places with a border of zeros, the channels of a place side by
//! side. There a kernel's row is one run of numbers, so nothing is copied for the products:
//!
//! | | rows of the product | inner side |
//! |---|---|---|
//! | output | output places | kernel's places x inputs |
//! | gradient of the input | input places | the kernel's places that reach them x outputs |
//! | gradient of the filters | kernel's places x inputs | output places |
//!
//! Sums run in an order that depends on nothing but the sizes, whatever the number of threads.

use super::gradient_kernel::{GradientKernel, TOGETHER};
use super::padded_maps::{Layout, PaddedMaps, to_maps};
use super::scratch::with_scratch;
use super::winograd::{self, PointFilters};
use deepsft_inference::gemm::{
    AlignedBuffer, Epilogue, MatrixRows, PackedMatrix, multiply, padded_channels, vector_width,
};
use pulp::{Arch, Simd, WithSimd};
use rayon::prelude::*;
use std::ops::Range;

/// Output places whose part of the filters' gradient is summed before the next ones: what they read stays in the cache.
const BAND: usize = 512;

/// A convolution with an odd kernel, half of which is the border of zeros.
#[derive(Clone, Copy, Debug)]
pub struct Convolving {
    pub inputs: usize,
    pub outputs: usize,
    pub kernel: usize,
    pub stride: usize,
    /// Rows and columns that are read.
    pub size: [usize; 2],
    /// What is read: negative numbers as zero, the others times this. `None` for all as they are.
    pub rectified: Option<f32>,
    /// By the sums of the definition, not by Winograd's method: more accurate and slower.
    pub by_definition: bool,
}

impl Convolving {
    /// Rows and columns that come out.
    pub fn output_size(&self) -> [usize; 2] {
        self.size.map(|side| side.div_ceil(self.stride))
    }

    fn border(&self) -> usize {
        self.kernel / 2
    }

    /// Whether Winograd's method applies.
    fn is_winograd(&self) -> bool {
        let is_large = self.size.iter().all(|&side| side >= winograd::TILE);
        self.kernel == 3 && self.stride == 1 && is_large && !self.by_definition
    }

    /// How maps of `channels` channels and the size `size` are read.
    fn layout(&self, channels: usize, size: [usize; 2]) -> Layout {
        Layout {
            channels,
            size,
            border: self.border(),
            pitch: padded_channels(channels),
            multiple: if self.is_winograd() { winograd::TILE } else { 1 },
        }
    }

    /// The output [N, outputs, rows, columns] for maps [N, inputs, rows, columns], `weights` [outputs, inputs, kernel, kernel]
    /// and `biases` [outputs]; and the maps as they were read, for the gradients.
    pub fn forward(&self, maps: &[f32], weights: &[f32], biases: &[f32]) -> (Vec<f32>, PaddedMaps) {
        let arch = Arch::new();
        let lanes = vector_width(arch);
        let mut layout = self.layout(self.inputs, self.size);
        if !self.is_winograd() {
            layout.pitch = self.inputs.next_multiple_of(TOGETHER);
        }
        let read = match self.rectified {
            Some(gain) => PaddedMaps::new(maps, &layout, |value| value.max(0.0) * gain),
            None => PaddedMaps::new(maps, &layout, |value| value),
        };
        let area = self.kernel * self.kernel;
        let finish = |_: usize, products: &mut [f32], out: &mut [f32]| {
            to_maps(products, padded_channels(self.outputs), out, biases)
        };
        if self.is_winograd() {
            let weight =
                |input: usize, output: usize, place: usize| weights[(output * self.inputs + input) * 9 + place];
            let filters = PointFilters::new(self.inputs, self.outputs, lanes, weight);
            let out = self.by_winograd(arch, &read, &filters, self.outputs, finish);
            return (out, read);
        }
        let mut filters = PackedMatrix::new(area * read.pitch, padded_channels(self.outputs), lanes);
        for (filter, weights) in weights.chunks_exact(area).enumerate() {
            let (output, input) = (filter / self.inputs, filter % self.inputs);
            for (place, &weight) in weights.iter().enumerate() {
                filters.set(place * read.pitch + input, output, weight);
            }
        }
        let all = Phase {
            first: [0, 0],
            start: [0, 0],
            rows: self.kernel,
            filters,
        };
        let steps = [self.stride, 1];
        let out = by_phases(&read, &[all], self.outputs, self.output_size(), steps, finish);
        (out, read)
    }

    /// The gradient of the output [N, outputs, rows, columns] as the other gradients read it.
    pub fn gradient(&self, gradient: &[f32]) -> PaddedMaps {
        PaddedMaps::new(gradient, &self.layout(self.outputs, self.output_size()), |value| value)
    }

    /// The gradient of the maps that were read.
    pub fn input_gradient(&self, gradient: &PaddedMaps, read: &PaddedMaps, weights: &[f32]) -> Vec<f32> {
        let arch = Arch::new();
        let lanes = vector_width(arch);
        let (stride, pitch) = (self.stride, padded_channels(self.inputs));
        let [height, width] = self.size;
        let finish = |sample: usize, products: &mut [f32], out: &mut [f32]| {
            if let Some(gain) = self.rectified {
                let rows = products.chunks_exact_mut(width * pitch);
                for (products, read_row) in rows.zip(read.within(sample).chunks(read.row)) {
                    for (products, read) in products.chunks_exact_mut(pitch).zip(read_row.chunks_exact(read.pitch)) {
                        for (product, &read) in products.iter_mut().zip(read) {
                            *product = if read > 0.0 { *product * gain } else { 0.0 };
                        }
                    }
                }
            }
            to_maps(products, pitch, out, &[]);
        };
        if self.is_winograd() {
            let weight =
                |output: usize, input: usize, place: usize| weights[(output * self.inputs + input) * 9 + 8 - place];
            let filters = PointFilters::new(self.outputs, self.inputs, lanes, weight);
            return self.by_winograd(arch, gradient, &filters, self.inputs, finish);
        }
        // Places whose distance is a multiple of the stride are reached by the same of the kernel's places.
        let phases: Vec<_> = (0..stride * stride)
            .filter(|phase| phase / stride < height && phase % stride < width)
            .filter_map(|phase| Phase::new(self, [phase / stride, phase % stride], weights, lanes))
            .collect();
        by_phases(gradient, &phases, self.inputs, self.size, [1, stride], finish)
    }

    /// Maps [N, channels, rows, columns] of the size that is read; `finish` gets a sample's number, places and maps.
    fn by_winograd(
        &self,
        arch: Arch,
        from: &PaddedMaps,
        filters: &PointFilters,
        channels: usize,
        finish: impl Fn(usize, &mut [f32], &mut [f32]) + Sync,
    ) -> Vec<f32> {
        let [rows, columns] = self.size;
        let map = rows * columns;
        let tiles = rows.div_ceil(winograd::TILE) * columns.div_ceil(winograd::TILE);
        let share = from.samples().div_ceil(rayon::current_num_threads());
        let together = winograd::CHUNK.div_ceil(tiles).min(share);
        let mut out = vec![0.0; from.samples() * channels * map];
        let [read, products] = filters.between(from);
        let groups = out.par_chunks_mut(together * channels * map).enumerate();
        groups.for_each(|(group, out)| {
            let samples = group * together..group * together + out.len() / (channels * map);
            let made = together * map * padded_channels(channels);
            with_scratch([read, products, made], |[read, products, made]| {
                let between = [read, products];
                winograd::convolve(arch, from, filters, samples.clone(), self.size, between, made);
                let made = made.chunks_exact_mut(map * padded_channels(channels));
                for ((sample, made), out) in samples.zip(made).zip(out.chunks_exact_mut(channels * map)) {
                    finish(sample, made, out);
                }
            });
        });
        out
    }

    /// The gradient of the biases.
    pub fn bias_gradient(&self, gradient: &PaddedMaps) -> Vec<f32> {
        let samples = gradient.values.values().par_chunks_exact(gradient.sample);
        let samples: Vec<Vec<f32>> = samples
            .map(|sample| {
                let mut sums = vec![0.0; gradient.pitch];
                for place in sample.chunks_exact(gradient.pitch) {
                    add(&mut sums, place);
                }
                sums
            })
            .collect();
        let mut sums = vec![0.0; self.outputs];
        for sample in &samples {
            add(&mut sums, sample);
        }
        sums
    }

    /// The gradient of the weights.
    pub fn filter_gradient(&self, gradient: &PaddedMaps, read: &PaddedMaps) -> Vec<f32> {
        let arch = Arch::new();
        let area = self.kernel * self.kernel;
        let pitch = gradient.pitch;
        if self.is_winograd() {
            // Threads share the channels: sums are the same for any number of threads.
            let lines = read.pitch / winograd::BLOCK;
            let together = lines.div_ceil(rayon::current_num_threads()) * winograd::BLOCK;
            let shares: Vec<usize> = (0..read.pitch).step_by(together).collect();
            let sums: Vec<AlignedBuffer> = shares
                .into_par_iter()
                .map(|first| {
                    let channels = first..read.pitch.min(first + together);
                    winograd::filter_gradient(arch, read, gradient, self.size, channels)
                })
                .collect();
            let sum = |input: usize, output: usize, place: usize| {
                sums[input / together].values()[(input % together * area + place) * pitch + output]
            };
            return self.filters(sum);
        }
        let blocks = self.inputs.div_ceil(TOGETHER);
        let mut sums = AlignedBuffer::new(area * blocks * TOGETHER * pitch);
        let together = (area * blocks).div_ceil(2 * rayon::current_num_threads());
        let chunks = sums
            .values_mut()
            .par_chunks_mut(together * TOGETHER * pitch)
            .enumerate();
        chunks.for_each(|(chunk, sums)| {
            arch.dispatch(FilterGradient {
                convolving: self,
                gradient,
                read,
                first: chunk * together,
                sums,
            });
        });
        let sums = sums.values();
        self.filters(|input, output, place| sums[(place * blocks * TOGETHER + input) * pitch + output])
    }

    /// Filters [outputs, inputs, kernel, kernel] from their numbers for an input, an output and a place.
    fn filters(&self, number: impl Fn(usize, usize, usize) -> f32 + Sync) -> Vec<f32> {
        let area = self.kernel * self.kernel;
        let mut filters = vec![0.0; self.outputs * self.inputs * area];
        let of_outputs = filters.par_chunks_exact_mut(self.inputs * area).enumerate();
        of_outputs.for_each(|(output, filters)| {
            for (input, filter) in filters.chunks_exact_mut(area).enumerate() {
                for (place, to) in filter.iter_mut().enumerate() {
                    *to = number(input, output, place);
                }
            }
        });
        filters
    }
}

/// Maps [N, channels, rows, columns] of the size `size`, sample by sample, whose places `phases` make; from one place of a phase
/// to its next are the steps `read` and `write`. `finish` gets a sample's number, places and maps.
fn by_phases(
    from: &PaddedMaps,
    phases: &[Phase],
    channels: usize,
    [height, width]: [usize; 2],
    [read, write]: [usize; 2],
    finish: impl Fn(usize, &mut [f32], &mut [f32]) + Sync,
) -> Vec<f32> {
    let (arch, pitch, places) = (Arch::new(), padded_channels(channels), height * width);
    let mut out = vec![0.0; from.samples() * channels * places];
    let samples = out.par_chunks_exact_mut(channels * places).enumerate();
    samples.for_each(|(sample, out)| {
        with_scratch([places * pitch], |[made]| {
            if phases.len() < write * write {
                made.fill(0.0);
            }
            for Phase {
                first: [y, x],
                start,
                rows: parts,
                filters,
            } in phases
            {
                let [rows, columns] = [height - y, width - x].map(|side| side.div_ceil(write));
                arch.dispatch(Product {
                    rows: MatrixRows {
                        values: &from.of_sample(sample)[start[0] * from.row + start[1] * from.pitch..],
                        count: rows * columns,
                        across: columns,
                        step: read * from.pitch,
                        line: read * from.row,
                        parts: *parts,
                        pitch: from.row,
                    },
                    matrix: filters,
                    epilogue: WriteRows {
                        across: columns,
                        step: write,
                        line: write * width,
                        pitch,
                        out: &mut made[(y * width + x) * pitch..],
                    },
                });
            }
            finish(sample, made, out);
        });
    });
    out
}

fn add(sums: &mut [f32], numbers: &[f32]) {
    for (sum, number) in sums.iter_mut().zip(numbers) {
        *sum += number;
    }
}

/// Places that lie a multiple of a step from the place `first`: all of the output, or of the input those that the same places
/// of the kernel reach.
struct Phase {
    first: [usize; 2],
    /// Where the first of them begins to read.
    start: [usize; 2],
    /// Rows of the kernel that it reads through.
    rows: usize,
    /// [row of the kernel, column, channel that is read] x channels; for the input's gradient rows and columns backwards.
    filters: PackedMatrix,
}

impl Phase {
    /// `None` for places that no place of the kernel reaches.
    fn new(convolving: &Convolving, first: [usize; 2], weights: &[f32], lanes: usize) -> Option<Self> {
        let (inputs, outputs) = (convolving.inputs, convolving.outputs);
        let (kernel, stride) = (convolving.kernel, convolving.stride);
        let border = convolving.border();
        let offset = first.map(|at| (at + border) % stride);
        let reaching = offset.map(|offset| kernel.saturating_sub(offset).div_ceil(stride));
        let [rows, columns] = reaching;
        if rows * columns == 0 {
            return None;
        }
        let start = [0, 1].map(|k| border + (first[k] + border - offset[k]) / stride + 1 - reaching[k]);
        let mut filters = PackedMatrix::new(
            rows * columns * padded_channels(outputs),
            padded_channels(inputs),
            lanes,
        );
        for (filter, weights) in weights.chunks_exact(kernel * kernel).enumerate() {
            let (output, input) = (filter / inputs, filter % inputs);
            for place in 0..rows * columns {
                let y = offset[0] + stride * (rows - 1 - place / columns);
                let x = offset[1] + stride * (columns - 1 - place % columns);
                filters.set(
                    place * padded_channels(outputs) + output,
                    input,
                    weights[y * kernel + x],
                );
            }
        }
        Some(Self {
            first,
            start,
            rows,
            filters,
        })
    }
}

/// A product of matrices whose rows go to places.
struct Product<'a> {
    rows: MatrixRows<'a>,
    matrix: &'a PackedMatrix,
    epilogue: WriteRows<'a>,
}

impl WithSimd for Product<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(mut self, simd: S) {
        multiply::<S, false>(simd, &self.rows, self.matrix, &mut self.epilogue);
    }
}

/// Puts rows of a product at places of a map: `across` of them `step` apart, then a line further.
struct WriteRows<'a> {
    across: usize,
    step: usize,
    line: usize,
    pitch: usize,
    out: &'a mut [f32],
}

impl<S: Simd> Epilogue<S> for WriteRows<'_> {
    #[inline(always)]
    fn begin(&mut self, _: S, _: Range<usize>) {}

    #[inline(always)]
    fn store(&mut self, _: S, row: usize, output: usize, sums: &[S::f32s]) {
        let place = row / self.across * self.line + row % self.across * self.step;
        let (to, _) = S::as_mut_simd_f32s(&mut self.out[place * self.pitch + output..]);
        for (to, &sum) in to.iter_mut().zip(sums) {
            *to = sum;
        }
    }
}

/// Sums of the filters' gradient: `sums` [kernel's place, block of [`TOGETHER`] inputs, input] x outputs from the block `first`
/// on.
struct FilterGradient<'a> {
    convolving: &'a Convolving,
    gradient: &'a PaddedMaps,
    read: &'a PaddedMaps,
    first: usize,
    sums: &'a mut [f32],
}

impl WithSimd for FilterGradient<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let (convolving, gradient, read) = (self.convolving, self.gradient, self.read);
        let (kernel, stride) = (convolving.kernel, convolving.stride);
        let [rows, columns] = convolving.output_size();
        let blocks = convolving.inputs.div_ceil(TOGETHER);
        let band = BAND.div_ceil(columns);
        for sample in 0..gradient.samples() {
            let (read_values, gradients) = (read.of_sample(sample), gradient.within(sample));
            for start in (0..rows).step_by(band) {
                let end = rows.min(start + band);
                for (block, sums) in self.sums.chunks_exact_mut(TOGETHER * gradient.pitch).enumerate() {
                    let block = self.first + block;
                    let (place, channel) = (block / blocks, block % blocks * TOGETHER);
                    let [y, x] = [place / kernel, place % kernel];
                    let kernel = GradientKernel {
                        read: &read_values[(stride * start + y) * read.row + x * read.pitch + channel..],
                        step: stride * read.pitch,
                        line: stride * read.row,
                        gradient: &gradients[start * gradient.row..],
                        pitch: gradient.pitch,
                        row: gradient.row,
                        rows: end - start,
                        columns,
                    };
                    kernel.add_to(simd, sums);
                }
            }
        }
    }
}
