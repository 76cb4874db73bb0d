//! Convolutions of a batch on the processor and their gradients, as products of matrices.
//!
//! The maps of a batch are brought into [`Places`]: rows of places with a border of zeros, the channels of a place side by
//! side. There a kernel's row is one run of numbers, so nothing is copied for the products:
//!
//! | | rows of the product | inner side |
//! |---|---|---|
//! | output | output places | kernel's places x inputs |
//! | gradient of the input | input places | the kernel's places that reach them x outputs |
//! | gradient of the filters | kernel's places x inputs | output places |
//!
//! Sums run in an order that depends on nothing but the sizes, whatever the number of threads.

use deepsft_inference::product::{Buffer, Packed, Rows, Sink, multiply, padded};
use pulp::{Arch, Simd, WithSimd};
use rayon::prelude::*;
use std::ops::Range;

/// Channels of the filters' gradient that are summed together; the channels of what is read are padded to multiples of it.
const TOGETHER: usize = 8;

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
}

/// Maps of a batch.
#[derive(Debug)]
pub struct Places {
    values: Buffer,
    /// Numbers of a sample, of a row and of a place.
    sample: usize,
    row: usize,
    pitch: usize,
}

impl Places {
    /// [N, channels, rows, columns] with a border of `border` places; `pitch` numbers a place.
    fn new(maps: &[f32], channels: usize, [rows, columns]: [usize; 2], border: usize, pitch: usize, read: impl Fn(f32) -> f32 + Sync) -> Self {
        let row = (columns + 2 * border) * pitch;
        let sample = (rows + 2 * border) * row;
        let map = channels * rows * columns;
        let mut values = Buffer::new(maps.len() / map * sample);
        let samples = values.values_mut().par_chunks_exact_mut(sample);
        samples.zip(maps.par_chunks_exact(map)).for_each(|(to, from)| {
            for y in 0..rows {
                let to = &mut to[(y + border) * row + border * pitch..][..columns * pitch];
                for first in (0..channels).step_by(TOGETHER) {
                    let line = |channel: usize| &from[(channel * rows + y) * columns..][..columns];
                    if first + TOGETHER <= channels {
                        let lines: [&[f32]; TOGETHER] = std::array::from_fn(|c| line(first + c));
                        for (x, to) in to.chunks_exact_mut(pitch).enumerate() {
                            let to = &mut to[first..first + TOGETHER];
                            for (to, line) in to.iter_mut().zip(lines) {
                                *to = read(line[x]);
                            }
                        }
                        continue;
                    }
                    for channel in first..channels {
                        for (to, &from) in to.chunks_exact_mut(pitch).zip(line(channel)) {
                            to[channel] = read(from);
                        }
                    }
                }
            }
        });
        Self {
            values,
            sample,
            row,
            pitch,
        }
    }

    fn of_sample(&self, sample: usize) -> &[f32] {
        &self.values.values()[sample * self.sample..][..self.sample]
    }
}

impl Convolving {
    /// Rows and columns that come out.
    pub fn output_size(&self) -> [usize; 2] {
        self.size.map(|side| side.div_ceil(self.stride))
    }

    fn border(&self) -> usize {
        self.kernel / 2
    }

    /// The output [N, outputs, rows, columns] for maps [N, inputs, rows, columns], `weights` [outputs, inputs, kernel, kernel]
    /// and `biases` [outputs]; and the maps as they were read, for the gradients.
    pub fn forward(&self, maps: &[f32], weights: &[f32], biases: &[f32]) -> (Vec<f32>, Places) {
        let arch = Arch::new();
        let pitch = self.inputs.next_multiple_of(TOGETHER);
        let read = match self.rectified {
            Some(gain) => {
                let positive = move |value: f32| if value > 0.0 { value * gain } else { 0.0 };
                Places::new(maps, self.inputs, self.size, self.border(), pitch, positive)
            }
            None => Places::new(maps, self.inputs, self.size, self.border(), pitch, |value| value),
        };
        let area = self.kernel * self.kernel;
        let mut filters = Packed::new(area * pitch, padded(self.outputs), arch.dispatch(Lanes));
        for (filter, weights) in weights.chunks_exact(area).enumerate() {
            let (output, input) = (filter / self.inputs, filter % self.inputs);
            for (place, &weight) in weights.iter().enumerate() {
                filters.set(place * pitch + input, output, weight);
            }
        }
        let [rows, columns] = self.output_size();
        let count = rows * columns;
        let mut out = vec![0.0; maps.len() / (self.inputs * self.size[0] * self.size[1]) * self.outputs * count];
        let samples = out.par_chunks_exact_mut(self.outputs * count).enumerate();
        let room = || Buffer::new(count * padded(self.outputs));
        samples.for_each_init(room, |products, (sample, out)| {
            arch.dispatch(Product {
                rows: Rows {
                    values: read.of_sample(sample),
                    count,
                    across: columns,
                    step: self.stride * read.pitch,
                    line: self.stride * read.row,
                    parts: self.kernel,
                    pitch: read.row,
                },
                matrix: &filters,
                sink: ToPlaces {
                    across: columns,
                    step: 1,
                    line: columns,
                    pitch: padded(self.outputs),
                    out: products.values_mut(),
                },
            });
            to_maps(products.values(), padded(self.outputs), out, count, |channel, value| value + biases[channel]);
        });
        (out, read)
    }

    /// The gradient of the output [N, outputs, rows, columns] as the other gradients read it.
    pub fn gradient(&self, gradient: &[f32]) -> Places {
        Places::new(gradient, self.outputs, self.output_size(), self.border(), padded(self.outputs), |value| value)
    }

    /// The gradient of the maps that were read.
    pub fn input_gradient(&self, gradient: &Places, read: &Places, weights: &[f32]) -> Vec<f32> {
        let arch = Arch::new();
        let lanes = arch.dispatch(Lanes);
        let (stride, pitch) = (self.stride, padded(self.inputs));
        let [height, width] = self.size;
        // Places whose distance is a multiple of the stride are reached by the same of the kernel's places.
        let phases: Vec<_> = (0..stride * stride)
            .filter(|phase| phase / stride < height && phase % stride < width)
            .filter_map(|phase| Phase::new(self, [phase / stride, phase % stride], weights, lanes))
            .collect();
        let (read_row, read_pitch) = (read.row, read.pitch);
        let samples = gradient.values.values().len() / gradient.sample;
        let mut out = vec![0.0; samples * self.inputs * height * width];
        let samples = out.par_chunks_exact_mut(self.inputs * height * width).enumerate();
        let room = || Buffer::new(height * width * pitch);
        samples.for_each_init(room, |products, (sample, out)| {
            for phase in &phases {
                let [y, x] = phase.first;
                let [rows, columns] = [height - y, width - x].map(|side| side.div_ceil(stride));
                let start = phase.start[0] * gradient.row + phase.start[1] * gradient.pitch;
                arch.dispatch(Product {
                    rows: Rows {
                        values: &gradient.of_sample(sample)[start..],
                        count: rows * columns,
                        across: columns,
                        step: gradient.pitch,
                        line: gradient.row,
                        parts: phase.rows,
                        pitch: gradient.row,
                    },
                    matrix: &phase.filters,
                    sink: ToPlaces {
                        across: columns,
                        step: stride,
                        line: stride * width,
                        pitch,
                        out: &mut products.values_mut()[(y * width + x) * pitch..],
                    },
                });
            }
            let products = products.values_mut();
            if let Some(gain) = self.rectified {
                let read = &read.of_sample(sample)[self.border() * (read.row + read.pitch)..];
                let rows = products.chunks_exact_mut(width * pitch).zip(read.chunks(read_row));
                for (products, read) in rows {
                    for (products, read) in products.chunks_exact_mut(pitch).zip(read.chunks(read_pitch)) {
                        for (product, &read) in products.iter_mut().zip(read) {
                            *product = if read > 0.0 { *product * gain } else { 0.0 };
                        }
                    }
                }
            }
            to_maps(products, pitch, out, height * width, |_, value| value);
        });
        out
    }

    /// The gradient of the biases.
    pub fn bias_gradient(&self, gradient: &Places) -> Vec<f32> {
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
    pub fn filter_gradient(&self, gradient: &Places, read: &Places) -> Vec<f32> {
        let arch = Arch::new();
        let area = self.kernel * self.kernel;
        let pitch = gradient.pitch;
        let mut sums = Buffer::new(area * read.pitch * pitch);
        let blocks = area * read.pitch / TOGETHER;
        let together = blocks.div_ceil(2 * rayon::current_num_threads());
        let chunks = sums.values_mut().par_chunks_mut(together * TOGETHER * pitch).enumerate();
        chunks.for_each(|(chunk, sums)| {
            arch.dispatch(FilterGradient {
                convolving: self,
                gradient,
                read,
                first: chunk * together * TOGETHER,
                sums,
            });
        });
        let sums = sums.values();
        let mut out = vec![0.0; self.outputs * self.inputs * area];
        for (filter, out) in out.chunks_exact_mut(area).enumerate() {
            let (output, input) = (filter / self.inputs, filter % self.inputs);
            for (place, out) in out.iter_mut().enumerate() {
                *out = sums[(place * read.pitch + input) * pitch + output];
            }
        }
        out
    }
}

fn add(sums: &mut [f32], numbers: &[f32]) {
    for (sum, number) in sums.iter_mut().zip(numbers) {
        *sum += number;
    }
}

/// The input places that lie a multiple of the stride from the place `first`.
struct Phase {
    first: [usize; 2],
    /// Where the first of them begins to read the gradient of the output.
    start: [usize; 2],
    /// Rows of the kernel that reach them.
    rows: usize,
    /// [row of the kernel, column, output] x inputs, rows and columns backwards.
    filters: Packed,
}

impl Phase {
    /// `None` for places that no place of the kernel reaches.
    fn new(convolving: &Convolving, first: [usize; 2], weights: &[f32], lanes: usize) -> Option<Self> {
        let Convolving {
            inputs,
            outputs,
            kernel,
            stride,
            ..
        } = *convolving;
        let border = convolving.border();
        let offset = first.map(|at| (at + border) % stride);
        let reaching = offset.map(|offset| kernel.saturating_sub(offset).div_ceil(stride));
        let [rows, columns] = reaching;
        if rows * columns == 0 {
            return None;
        }
        let start = [0, 1].map(|k| border + (first[k] + border - offset[k]) / stride + 1 - reaching[k]);
        let mut filters = Packed::new(rows * columns * padded(outputs), padded(inputs), lanes);
        for (filter, weights) in weights.chunks_exact(kernel * kernel).enumerate() {
            let (output, input) = (filter / inputs, filter % inputs);
            for place in 0..rows * columns {
                let y = offset[0] + stride * (rows - 1 - place / columns);
                let x = offset[1] + stride * (columns - 1 - place % columns);
                filters.set(place * padded(outputs) + output, input, weights[y * kernel + x]);
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

/// Numbers in a vector of this processor.
struct Lanes;

impl WithSimd for Lanes {
    type Output = usize;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> usize {
        S::F32_LANES
    }
}

/// A product of matrices whose rows go to places.
struct Product<'a> {
    rows: Rows<'a>,
    matrix: &'a Packed,
    sink: ToPlaces<'a>,
}

impl WithSimd for Product<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(mut self, simd: S) {
        multiply::<S, false>(simd, &self.rows, self.matrix, &mut self.sink);
    }
}

/// Puts rows of a product at places of a map: `across` of them `step` apart, then a line further.
struct ToPlaces<'a> {
    across: usize,
    step: usize,
    line: usize,
    pitch: usize,
    out: &'a mut [f32],
}

impl<S: Simd> Sink<S> for ToPlaces<'_> {
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

/// `count` places of `pitch` numbers each -> maps [channels, count]. `finish` gets the channel and a value.
#[inline(always)]
fn to_maps(places: &[f32], pitch: usize, maps: &mut [f32], count: usize, finish: impl Fn(usize, f32) -> f32) {
    // Places of a block stay in the cache until all of their channels are read.
    const BLOCK: usize = 32;
    for start in (0..count).step_by(BLOCK) {
        let end = count.min(start + BLOCK);
        for (channel, map) in maps.chunks_exact_mut(count).enumerate() {
            let places = places[start * pitch..end * pitch].chunks_exact(pitch);
            for (to, from) in map[start..end].iter_mut().zip(places) {
                *to = finish(channel, from[channel]);
            }
        }
    }
}

/// Sums of the filters' gradient: `sums` [kernel's place, input] x outputs from the row `first` on, a multiple of
/// [`TOGETHER`].
struct FilterGradient<'a> {
    convolving: &'a Convolving,
    gradient: &'a Places,
    read: &'a Places,
    first: usize,
    sums: &'a mut [f32],
}

impl WithSimd for FilterGradient<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self {
            convolving,
            gradient,
            read,
            first,
            sums,
        } = self;
        let (kernel, stride, border) = (convolving.kernel, convolving.stride, convolving.border());
        let [rows, columns] = convolving.output_size();
        let samples = gradient.values.values().len() / gradient.sample;
        let band = BAND.div_ceil(columns);
        for sample in 0..samples {
            let (read_values, gradients) = (read.of_sample(sample), gradient.of_sample(sample));
            for start in (0..rows).step_by(band) {
                let end = rows.min(start + band);
                for (block, sums) in sums.chunks_exact_mut(TOGETHER * gradient.pitch).enumerate() {
                    let row = first + block * TOGETHER;
                    let (place, channel) = (row / read.pitch, row % read.pitch);
                    let [y, x] = [place / kernel, place % kernel];
                    let mut outputs = 0;
                    while outputs < gradient.pitch {
                        let along = Along {
                            read: &read_values[(stride * start + y) * read.row + x * read.pitch + channel..],
                            step: stride * read.pitch,
                            line: stride * read.row,
                            gradient: &gradients[(start + border) * gradient.row + border * gradient.pitch + outputs..],
                            pitch: gradient.pitch,
                            row: gradient.row,
                            rows: end - start,
                            columns,
                        };
                        let sums = &mut sums[outputs..];
                        outputs += match S::F32_LANES {
                            16 if gradient.pitch - outputs >= 32 => along.add::<S, 8, 2>(simd, sums),
                            16 => along.add::<S, 8, 1>(simd, sums),
                            _ => along.add::<S, 4, 2>(simd, sums),
                        };
                    }
                }
            }
        }
    }
}

/// Products along places of a map.
struct Along<'a> {
    read: &'a [f32],
    step: usize,
    line: usize,
    gradient: &'a [f32],
    pitch: usize,
    row: usize,
    rows: usize,
    columns: usize,
}

impl Along<'_> {
    /// Adds to [`TOGETHER`] rows of `sums`; returns the number of outputs.
    #[inline(always)]
    fn add<S: Simd, const ROWS: usize, const VECTORS: usize>(&self, simd: S, sums: &mut [f32]) -> usize {
        for first in (0..TOGETHER).step_by(ROWS) {
            let mut totals = [[simd.splat_f32s(0.0); VECTORS]; ROWS];
            for y in 0..self.rows {
                let read = self.read[y * self.line + first..].chunks(self.step);
                let gradient = self.gradient[y * self.row..].chunks(self.pitch);
                for (read, gradient) in read.zip(gradient).take(self.columns) {
                    let read: &[f32] = &read[..ROWS];
                    let gradient: &[S::f32s] = &S::as_simd_f32s(&gradient[..VECTORS * S::F32_LANES]).0[..VECTORS];
                    for (totals, &number) in totals.iter_mut().zip(read) {
                        let number = simd.splat_f32s(number);
                        for (total, &gradient) in totals.iter_mut().zip(gradient) {
                            *total = simd.mul_add_e_f32s(number, gradient, *total);
                        }
                    }
                }
            }
            for (r, totals) in totals.iter().enumerate() {
                let (sums, _) = S::as_mut_simd_f32s(&mut sums[(first + r) * self.pitch..]);
                for (sum, &total) in sums.iter_mut().zip(totals) {
                    *sum = simd.add_f32s(*sum, total);
                }
            }
        }
        VECTORS * S::F32_LANES
    }
}
