//! A plan on the processor.

use super::convolution::PackedConvolution;
use super::dense::{DenseBlocks, PackedDense};
use super::gemm::vector_width;
use super::layout::{AlignedBuffer, BLOCK, Maps, Scratch, padded_channels};
use super::pool::PooledRows;
use super::team::{Chunks, MAX_THREADS, in_parallel, with_team};
use crate::plan::{MapId, MapShape, MaxPool, Operation, Plan, SkipInput};
use pulp::Arch;
use std::ops::Range;

#[derive(Debug)]
enum Layer {
    Convolution(Box<PackedConvolution>),
    Sum(MapId, SkipInput),
    Pool(MaxPool),
    Dense(PackedDense),
}

/// A plan with packed filters and the memory of its maps. On one thread it runs without allocating; queues of several allocate now and
/// then.
#[derive(Debug)]
pub(crate) struct CpuPlan {
    arch: Arch,
    shapes: Vec<MapShape>,
    /// The buffer of each map; maps that are not needed at the same time share one.
    slots: Vec<usize>,
    buffers: Vec<AlignedBuffer>,
    layers: Vec<(Layer, MapId)>,
    /// One for each thread, and one that they share.
    scratches: Vec<Scratch>,
    shared: Scratch,
}

impl CpuPlan {
    /// Packs `plan` for this processor and `threads` threads (at most 8). The maps `kept` can be read after the last step, as can those
    /// that the caller writes; the others may be overwritten by then.
    pub(crate) fn new(plan: Plan, kept: &[MapId], threads: usize) -> Self {
        Self::with_arch(Arch::new(), plan, kept, threads)
    }

    fn with_arch(arch: Arch, plan: Plan, kept: &[MapId], threads: usize) -> Self {
        let width = vector_width(arch);
        let (slots, sizes) = plan.shared_buffers(kept, padded_channels);
        let Plan { maps: shapes, steps } = plan;
        let threads = threads.clamp(1, MAX_THREADS);
        let (mut layers, mut lengths) = (Vec::new(), [[0, 0]; 2]);
        for step in steps {
            let layer = match step.operation {
                Operation::Add(map, skip) => Layer::Sum(map, skip),
                Operation::Pool(pool) => Layer::Pool(pool),
                Operation::Dense(dense) => Layer::Dense(PackedDense::new(dense, &shapes)),
                Operation::Convolve(convolution) => {
                    let packed = PackedConvolution::new(convolution, shapes[step.output.0], &shapes, width);
                    let needed = packed.scratch(&shapes, threads);
                    lengths = [0, 1].map(|of| [0, 1].map(|k| needed[of][k].max(lengths[of][k])));
                    Layer::Convolution(Box::new(packed))
                }
            };
            layers.push((layer, step.output));
        }
        let scratch = |lengths: [usize; 2]| {
            let [read, products] = lengths.map(AlignedBuffer::new);
            Scratch { read, products }
        };
        Self {
            arch,
            shapes,
            slots,
            buffers: sizes.into_iter().map(AlignedBuffer::new).collect(),
            layers,
            scratches: (0..threads).map(|_| scratch(lengths[0])).collect(),
            shared: scratch(lengths[1]),
        }
    }

    pub(crate) fn shape(&self, map: MapId) -> MapShape {
        self.shapes[map.0]
    }

    /// Values of a position in [`CpuPlan::values`]: the channels, padded.
    pub(crate) fn pitch(&self, map: MapId) -> usize {
        padded_channels(self.shapes[map.0].channels)
    }

    /// A map that the caller wrote or had kept; others may have been overwritten. Rows of positions, the channels of a position
    /// side by side and padded.
    pub(crate) fn values(&self, map: MapId) -> &[f32] {
        &self.buffers[self.slots[map.0]].values()[..self.length(map)]
    }

    /// The channels of each position of such a map, without their padding.
    pub(crate) fn positions(&self, map: MapId) -> impl Iterator<Item = &[f32]> {
        let channels = self.shape(map).channels;
        let positions = self.values(map).chunks_exact(self.pitch(map));
        positions.map(move |position| &position[..channels])
    }

    fn length(&self, map: MapId) -> usize {
        self.shapes[map.0].area() * self.pitch(map)
    }

    /// A map to write. The padding of channels is zero and has to stay so.
    pub(crate) fn values_mut(&mut self, map: MapId) -> &mut [f32] {
        let length = self.length(map);
        &mut self.buffers[self.slots[map.0]].values_mut()[..length]
    }

    pub(crate) fn threads(&self) -> usize {
        self.scratches.len()
    }

    pub(crate) fn steps(&self) -> usize {
        self.layers.len()
    }

    pub(crate) fn run(&mut self, steps: Range<usize>) {
        with_team(self.threads(), || steps.for_each(|step| self.run_step(step)));
    }

    fn run_step(&mut self, step: usize) {
        let (arch, (layer, output)) = (self.arch, &self.layers[step]);
        let (output, shape) = (self.slots[output.0], self.shapes[output.0]);
        let mut out = std::mem::take(&mut self.buffers[output]);
        let maps = Maps {
            shapes: &self.shapes,
            slots: &self.slots,
            buffers: &self.buffers,
        };
        let row = shape.width * padded_channels(shape.channels);
        let values = &mut out.values_mut()[..shape.height * row];
        match layer {
            Layer::Convolution(layer) => layer.run(arch, maps, &mut self.scratches, &mut self.shared, values),
            Layer::Pool(pool) => {
                let out = Chunks::whole(values, row);
                in_parallel(&mut self.scratches, 0..shape.height, out, &|_, rows, out| {
                    arch.dispatch(PooledRows {
                        pool: *pool,
                        map: maps.view(pool.map),
                        output: shape,
                        rows,
                        out: out.values,
                    });
                });
            }
            Layer::Dense(dense) => {
                let (read, out) = (maps.view(dense.map).values, Chunks::whole(values, BLOCK));
                in_parallel(&mut self.scratches, 0..dense.blocks(), out, &|_, blocks, out| {
                    arch.dispatch(DenseBlocks {
                        dense,
                        read,
                        blocks,
                        out: out.values,
                    });
                });
            }
            Layer::Sum(map, skip) => add(&maps, *map, *skip, values),
        }
        self.buffers[output] = out;
    }
}

fn add(maps: &Maps<'_>, map: MapId, skip: SkipInput, out: &mut [f32]) {
    let (map, skipped) = (maps.view(map), maps.view(skip.map));
    let (pitch, width) = (map.pitch(), map.shape.width);
    let positions = out.chunks_exact_mut(pitch).zip(map.values.chunks_exact(pitch));
    for (position, (out, a)) in positions.enumerate() {
        let y = (position / width + skip.top) / skip.factor;
        let x = position % width / skip.factor;
        let b = &skipped.values[(y * skipped.shape.width + x) * pitch..][..pitch];
        for (out, (a, b)) in out.iter_mut().zip(a.iter().zip(b)) {
            *out = a + b;
        }
    }
}

#[cfg(test)]
#[path = "../../tests/inside/cpu_plan.rs"]
mod tests;
