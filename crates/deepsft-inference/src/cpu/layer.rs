//! A convolution with its packed filters.

use super::bands::{Units, in_bands};
use super::buffer::{Buffer, MapView, padded};
use super::direct::Direct;
use super::winograd::Winograd;
use crate::plan::{Convolution, MapId, MapShape};
use pulp::{Arch, Simd, WithSimd};
use std::ops::Range;

/// The maps of a plan while a layer works.
#[derive(Clone, Copy)]
pub(crate) struct Maps<'a> {
    pub(crate) shapes: &'a [MapShape],
    pub(crate) slots: &'a [usize],
    pub(crate) buffers: &'a [Buffer],
}

impl<'a> Maps<'a> {
    pub(crate) fn view(&self, map: MapId) -> MapView<'a> {
        let shape = self.shapes[map.0];
        let length = shape.height * shape.width * padded(shape.channels);
        MapView {
            shape,
            values: &self.buffers[self.slots[map.0]].values()[..length],
        }
    }
}

/// What a thread needs beside the maps.
pub(crate) struct Scratch {
    pub(crate) read: Buffer,
    pub(crate) products: Buffer,
}

enum Method {
    Winograd(Winograd),
    Direct(Direct),
}

/// A convolution that is ready to run.
pub(crate) struct Layer {
    pub(crate) convolution: Convolution,
    pub(crate) output: MapShape,
    pub(crate) biases: Buffer,
    method: Method,
    /// What Winograd's method cannot do: the rows whose filters reach rows that are cropped.
    borders: Option<Direct>,
}

impl Layer {
    /// Packs `convolution` for vectors of `lanes` numbers; its weights are not kept beside the packed ones.
    pub(crate) fn new(mut convolution: Convolution, output: MapShape, shapes: &[MapShape], lanes: usize) -> Self {
        let mut biases = Buffer::new(padded(output.channels));
        biases.values_mut()[..output.channels].copy_from_slice(&convolution.filters.biases);
        let direct = || Direct::new(&convolution, shapes, lanes);
        let (method, borders) = match Winograd::new(&convolution, output, shapes, lanes) {
            Some(winograd) => {
                let reaches_cropped = winograd.factor > 1 && convolution.inputs[0].cropped != [0, 0];
                let borders = reaches_cropped.then(direct);
                (Method::Winograd(winograd), borders)
            }
            None => (Method::Direct(direct()), None),
        };
        convolution.filters.weights = Vec::new();
        Self {
            convolution,
            output,
            biases,
            method,
            borders,
        }
    }

    /// Lengths of the buffers of each of `threads` scratches, and of the one that they share.
    pub(crate) fn scratch(&self, shapes: &[MapShape], threads: usize) -> [[usize; 2]; 2] {
        let first = self.convolution.inputs[0];
        let [_, width] = first.size(shapes[first.map.0]);
        let of_rows = |direct: &Direct, rows: usize| direct.scratch(&self.convolution, width, rows.div_ceil(threads));
        let borders = self.borders.as_ref();
        let borders = borders.map_or(0, |direct| of_rows(direct, self.convolution.filters.kernel / 2));
        match &self.method {
            Method::Direct(direct) => [[of_rows(direct, self.output.height), 0], [0, 0]],
            Method::Winograd(winograd) => {
                let [read, products] = winograd.scratch();
                match winograd.is_shared {
                    true => [[borders, 0], [read, products]],
                    false => [[borders.max(read), products], [0, 0]],
                }
            }
        }
    }

    /// Makes the output, `out`.
    pub(crate) fn run(
        &self,
        arch: Arch,
        maps: Maps<'_>,
        scratches: &mut [Scratch],
        shared: &mut Scratch,
        out: &mut [f32],
    ) {
        match &self.method {
            Method::Direct(direct) => self.run_direct(direct, arch, maps, scratches, 0..self.output.height, out),
            Method::Winograd(winograd) => winograd.run(arch, self, maps, scratches, shared, out),
        }
        if let Some(borders) = &self.borders {
            let (height, border) = (self.output.height, self.convolution.filters.kernel / 2);
            for rows in [0..border.min(height), height.saturating_sub(border)..height] {
                self.run_direct(borders, arch, maps, scratches, rows, out);
            }
        }
    }

    /// Makes the rows `rows` of the output, `out`, by the sums of the definition.
    fn run_direct(
        &self,
        direct: &Direct,
        arch: Arch,
        maps: Maps<'_>,
        scratches: &mut [Scratch],
        rows: Range<usize>,
        out: &mut [f32],
    ) {
        let row = self.row();
        let out = &mut out[rows.start * row..rows.end * row];
        in_bands(scratches, rows, Units::whole(out, row), &|scratch, rows, out| {
            arch.dispatch(Band {
                layer: self,
                direct,
                maps,
                scratch,
                rows,
                out: out.values,
            });
        });
    }

    /// Numbers of a row of the output.
    pub(crate) fn row(&self) -> usize {
        self.output.width * padded(self.output.channels)
    }

    /// What is added at a place and right of it; nothing where nothing is.
    #[inline(always)]
    pub(crate) fn added<'a>(&self, maps: &Maps<'a>, row: usize, column: usize) -> &'a [f32] {
        let Some(added) = self.convolution.added else {
            return &[];
        };
        let map = maps.view(added.map);
        let place = match added.factor {
            1 => (row + added.top) * map.shape.width + column,
            factor => (row + added.top) / factor * map.shape.width + column / factor,
        };
        &map.values[place * map.pitch()..]
    }

    /// The vector of outputs from `channel` on at a place: `sums`, the biases and what is added.
    #[inline(always)]
    pub(crate) fn finished<S: Simd>(&self, simd: S, sums: S::f32s, added: &[f32], channel: usize) -> S::f32s {
        let mut sums = simd.add_f32s(sums, vector::<S>(self.biases.values(), channel));
        if !added.is_empty() {
            sums = simd.add_f32s(sums, vector::<S>(added, channel));
        }
        if self.convolution.rectified {
            sums = simd.max_f32s(simd.splat_f32s(0.0), sums);
        }
        sums
    }
}

/// The vector of `values` from `at` on.
#[inline(always)]
pub(crate) fn vector<S: Simd>(values: &[f32], at: usize) -> S::f32s {
    S::as_simd_f32s(&values[at..at + S::F32_LANES]).0[0]
}

struct Band<'a> {
    layer: &'a Layer,
    direct: &'a Direct,
    maps: Maps<'a>,
    scratch: &'a mut Scratch,
    rows: Range<usize>,
    out: &'a mut [f32],
}

impl WithSimd for Band<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self {
            layer,
            direct,
            maps,
            scratch,
            rows,
            out,
        } = self;
        direct.run(simd, layer, &maps, scratch, rows, out);
    }
}
