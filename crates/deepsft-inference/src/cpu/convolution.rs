//! A convolution with its packed filters.

use super::direct::Direct;
use super::layer_spec::{LayerRun, LayerSpec};
use super::layout::{Maps, Scratch};
use super::winograd::Winograd;
use crate::plan::{Convolution, MapShape};
use pulp::Arch;

#[derive(Debug)]
enum Method {
    Winograd(Winograd),
    Direct(Direct),
}

/// A convolution that is ready to run.
#[derive(Debug)]
pub(crate) struct PackedConvolution {
    spec: LayerSpec,
    method: Method,
    /// What Winograd's method cannot do: the rows whose filters reach rows that are cropped.
    borders: Option<Direct>,
}

impl PackedConvolution {
    /// Packs `convolution` for vectors of `width` numbers; its weights are not kept beside the packed ones.
    pub(crate) fn new(mut convolution: Convolution, output: MapShape, shapes: &[MapShape], width: usize) -> Self {
        let direct = || Direct::new(&convolution, shapes, width);
        let (method, borders) = match Winograd::new(&convolution, output, shapes, width) {
            Some(winograd) => {
                let reaches_cropped = winograd.tiling.factor > 1 && convolution.inputs[0].cropped != [0, 0];
                let borders = reaches_cropped.then(direct);
                (Method::Winograd(winograd), borders)
            }
            None => (Method::Direct(direct()), None),
        };
        convolution.filters.weights = Vec::new();
        Self {
            spec: LayerSpec::new(convolution, output),
            method,
            borders,
        }
    }

    /// Lengths of the buffers of each of `threads` scratches, and of the one that they share.
    pub(crate) fn scratch(&self, shapes: &[MapShape], threads: usize) -> [[usize; 2]; 2] {
        let LayerSpec {
            convolution, output, ..
        } = &self.spec;
        let first = convolution.inputs[0];
        let [_, width] = first.size(shapes[first.map.0]);
        let of_rows = |direct: &Direct, rows: usize| direct.scratch(convolution, width, rows.div_ceil(threads));
        let borders = self.borders.as_ref();
        let borders = borders.map_or(0, |direct| of_rows(direct, convolution.filters.kernel / 2));
        match &self.method {
            Method::Direct(direct) => [[of_rows(direct, output.height), 0], [0, 0]],
            Method::Winograd(winograd) => {
                let [read, products] = winograd.tiling.scratch();
                match winograd.is_shared {
                    true => [[borders, 0], [read, products]],
                    false => [[borders.max(read), products], [0, 0]],
                }
            }
        }
    }

    pub(crate) fn run(
        &self,
        arch: Arch,
        maps: Maps<'_>,
        scratches: &mut [Scratch],
        shared: &mut Scratch,
        out: &mut [f32],
    ) {
        let spec = &self.spec;
        let layer = LayerRun { arch, spec, maps };
        match &self.method {
            Method::Direct(direct) => direct.run(layer, scratches, 0..spec.output.height, out),
            Method::Winograd(winograd) => winograd.run(layer, scratches, shared, out),
        }
        if let Some(borders) = &self.borders {
            let (height, border) = (spec.output.height, spec.convolution.filters.kernel / 2);
            for rows in [0..border.min(height), height.saturating_sub(border)..height] {
                borders.run(layer, scratches, rows, out);
            }
        }
    }
}
