//! A convolution with its packed filters.

use super::buffer::{Buffer, MapView, padded};
use super::direct::Direct;
use super::winograd::Winograd;
use crate::plan::{Added, Convolution, MapId, MapShape};
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
        MapView {
            shape: self.shapes[map.0],
            values: self.buffers[self.slots[map.0]].values(),
        }
    }
}

/// What a thread needs beside the maps.
pub(crate) struct Scratch {
    pub(crate) read: Buffer,
    pub(crate) products: Buffer,
}

/// Where the input channels of a convolution lie when they are padded map by map.
pub(crate) struct Channels {
    /// Number of input channels with their padding.
    pub(crate) padded: usize,
    /// The padded channels of the filters' channels.
    pub(crate) places: Vec<usize>,
}

impl Channels {
    fn new(convolution: &Convolution, shapes: &[MapShape]) -> Self {
        let (mut places, mut first) = (Vec::new(), 0);
        for input in &convolution.inputs {
            let channels = shapes[input.map.0].channels;
            places.extend(first..first + channels);
            first += padded(channels);
        }
        Self { padded: first, places }
    }
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
}

impl Layer {
    /// Packs `convolution` for vectors of `lanes` numbers; its weights are not kept beside the packed ones.
    pub(crate) fn new(mut convolution: Convolution, output: MapShape, shapes: &[MapShape], lanes: usize) -> Self {
        let channels = Channels::new(&convolution, shapes);
        let filters = &mut convolution.filters;
        let mut biases = Buffer::new(padded(output.channels));
        biases.values_mut()[..output.channels].copy_from_slice(&filters.biases);
        let method = match (filters.kernel, convolution.stride) {
            (3, 1) => Method::Winograd(Winograd::new(filters, &channels, lanes)),
            _ => Method::Direct(Direct::new(filters, &channels, lanes)),
        };
        filters.weights = Vec::new();
        Self {
            convolution,
            output,
            biases,
            method,
        }
    }

    /// Rows of the output that are made together.
    pub(crate) fn rows_of_unit(&self) -> usize {
        match self.method {
            Method::Winograd(_) => super::winograd::TILE,
            Method::Direct(_) => 1,
        }
    }

    /// Lengths of the scratch's buffers for a band of `units` units.
    pub(crate) fn scratch(&self, input: MapShape, units: usize) -> [usize; 2] {
        match &self.method {
            Method::Winograd(winograd) => winograd.scratch(),
            Method::Direct(direct) => [direct.scratch(&self.convolution, input, units), 0],
        }
    }

    /// Makes the units `units` of the output, `out`.
    pub(crate) fn run(&self, arch: Arch, maps: Maps<'_>, scratch: &mut Scratch, units: Range<usize>, out: &mut [f32]) {
        arch.dispatch(Band {
            layer: self,
            maps,
            scratch,
            units,
            out,
        });
    }

    /// The vector of outputs from `channel` on at a position: `sums`, the biases and what is added.
    #[inline(always)]
    pub(crate) fn finished<S: Simd>(
        &self,
        simd: S,
        maps: &Maps<'_>,
        sums: S::f32s,
        [row, column, channel]: [usize; 3],
    ) -> S::f32s {
        let sums = simd.add_f32s(sums, vector::<S>(self.biases.values(), channel));
        let Some(added) = self.convolution.added else {
            return sums;
        };
        let (map, row, column) = match added {
            Added::Same(map) => (map, row, column),
            Added::Doubled(map) => (map, row / 2, column / 2),
        };
        let map = maps.view(map);
        let at = (row * map.shape.width + column) * map.pitch() + channel;
        simd.add_f32s(sums, vector::<S>(map.values, at))
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
        match &layer.method {
            Method::Winograd(winograd) => winograd.run(simd, layer, &maps, scratch, units, out),
            Method::Direct(direct) => direct.run(simd, layer, &maps, scratch, units, out),
        }
    }
}
