//! A convolution with its packed filters.

use super::bands::in_bands;
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
        let (method, borders) = match Winograd::new(&convolution, shapes, lanes) {
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

    /// Rows of the output that are made together, and by how many rows the first of these units is shorter.
    fn rows_of_unit(&self) -> (usize, usize) {
        match &self.method {
            Method::Winograd(winograd) => winograd.rows_of_unit(&self.convolution),
            Method::Direct(_) => (1, 0),
        }
    }

    fn units(&self) -> usize {
        let (rows, missing) = self.rows_of_unit();
        (self.output.height + missing).div_ceil(rows)
    }

    /// Lengths of the buffers of each of `threads` scratches.
    pub(crate) fn scratch(&self, shapes: &[MapShape], threads: usize) -> [usize; 2] {
        let first = self.convolution.inputs[0];
        let [_, width] = first.size(shapes[first.map.0]);
        let border = self.convolution.filters.kernel / 2;
        let mut lengths = match &self.method {
            Method::Winograd(winograd) => winograd.scratch(),
            Method::Direct(direct) => [
                direct.scratch(&self.convolution, width, self.units().div_ceil(threads)),
                0,
            ],
        };
        if let Some(direct) = &self.borders {
            lengths[0] = lengths[0].max(direct.scratch(&self.convolution, width, border));
        }
        lengths
    }

    /// Makes the output, `out`.
    pub(crate) fn run(&self, arch: Arch, maps: Maps<'_>, scratches: &mut [Scratch], out: &mut [f32]) {
        let (rows, missing) = self.rows_of_unit();
        let row = self.output.width * padded(self.output.channels);
        let lengths = [rows * row, missing * row];
        in_bands(scratches, 0..self.units(), out, lengths, &|scratch, units, out| {
            arch.dispatch(Band {
                layer: self,
                maps,
                scratch,
                units,
                out,
            });
        });
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
    maps: Maps<'a>,
    scratch: &'a mut Scratch,
    units: Range<usize>,
    out: &'a mut [f32],
}

impl WithSimd for Band<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self {
            layer,
            maps,
            scratch,
            units,
            out,
        } = self;
        let (direct, rows) = match &layer.method {
            Method::Direct(direct) => (Some(direct), [units.clone(), 0..0]),
            Method::Winograd(winograd) => {
                winograd.run(simd, layer, &maps, scratch, units.clone(), out);
                let made = winograd.rows_made(layer, units);
                let border = layer.convolution.filters.kernel / 2;
                let below = layer.output.height.saturating_sub(border);
                let ranges = [made.start..made.end.min(border), made.start.max(below)..made.end];
                (layer.borders.as_ref(), ranges)
            }
        };
        let row = layer.output.width * padded(layer.output.channels);
        let first = rows[0].start;
        for rows in rows {
            if let Some(direct) = direct.filter(|_| !rows.is_empty()) {
                let out = &mut out[(rows.start - first) * row..];
                direct.run(simd, layer, &maps, scratch, rows, out);
            }
        }
    }
}
