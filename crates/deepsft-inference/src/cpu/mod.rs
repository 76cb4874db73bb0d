//! A plan on the processor.

mod bands;
mod buffer;
mod dense;
mod direct;
mod layer;
mod pool;
mod product;
#[cfg(test)]
mod tests;
mod winograd;

use crate::plan::{Added, MapId, MapShape, Operation, Plan, Pool};
pub use bands::available_threads;
pub(crate) use bands::{Shared, Units, awake, in_bands};
use buffer::BLOCK;
pub use buffer::{Buffer, padded};
use dense::Dense;
use layer::{Layer, Maps, Scratch};
use pool::Pooled;
pub use product::{Packed, Rows, Sink, multiply};
use pulp::{Arch, Simd, WithSimd};
use std::ops::Range;
#[cfg(feature = "webgpu")]
pub(crate) use winograd::{POINTS, READ, TILE, filter_at_points};
pub use winograd::{Products, odd_lines, to_places, to_points};

/// More would find nothing to do: the map with most work has nine rows of tiles. Each thread has 2 MB of its own.
pub(crate) const MAX_THREADS: usize = 8;

enum Work {
    Layer(Box<Layer>),
    Add(MapId, Added),
    Pool(Pool),
    Dense(Dense),
}

/// A plan with packed filters and the memory of its maps. On one thread it runs without allocating; rayon's queues allocate now and then.
pub struct CpuPlan {
    arch: Arch,
    shapes: Vec<MapShape>,
    /// The buffer of each map; maps that are not needed at the same time share one.
    slots: Vec<usize>,
    buffers: Vec<Buffer>,
    work: Vec<(Work, MapId)>,
    /// One for each thread, and one that they share.
    scratches: Vec<Scratch>,
    shared: Scratch,
}

impl std::fmt::Debug for CpuPlan {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("CpuPlan")
            .field("shapes", &self.shapes)
            .finish_non_exhaustive()
    }
}

impl CpuPlan {
    /// Gets `plan` ready for this processor and `threads` threads (at most 8). The maps `kept` can be read after the last step,
    /// as can those that the caller writes; the others may be overwritten by then.
    pub fn new(plan: Plan, kept: &[MapId], threads: usize) -> Self {
        Self::with_arch(Arch::new(), plan, kept, threads)
    }

    fn with_arch(arch: Arch, plan: Plan, kept: &[MapId], threads: usize) -> Self {
        let lanes = arch.dispatch(Lanes);
        let (slots, sizes) = plan.shared_buffers(kept, padded);
        let Plan { maps: shapes, steps } = plan;
        let threads = threads.clamp(1, MAX_THREADS);
        let (mut work, mut lengths) = (Vec::new(), [[0, 0]; 2]);
        for step in steps {
            let output = shapes[step.output.0];
            let done = match step.operation {
                Operation::Add(map, added) => Work::Add(map, added),
                Operation::Pool(pool) => Work::Pool(pool),
                Operation::Dense(dense) => {
                    let read = shapes[dense.map.0];
                    Work::Dense(Dense::new(dense, read))
                }
                Operation::Convolve(convolution) => {
                    let layer = Layer::new(convolution, output, &shapes, lanes);
                    let needed = layer.scratch(&shapes, threads);
                    lengths = [0, 1].map(|of| [0, 1].map(|k| needed[of][k].max(lengths[of][k])));
                    Work::Layer(Box::new(layer))
                }
            };
            work.push((done, step.output));
        }
        let scratch = |lengths: [usize; 2]| {
            let [read, products] = lengths.map(Buffer::new);
            Scratch { read, products }
        };
        Self {
            arch,
            shapes,
            slots,
            buffers: sizes.into_iter().map(Buffer::new).collect(),
            work,
            scratches: (0..threads).map(|_| scratch(lengths[0])).collect(),
            shared: scratch(lengths[1]),
        }
    }

    /// Size of a map.
    pub fn shape(&self, map: MapId) -> MapShape {
        self.shapes[map.0]
    }

    /// Values of one position in [`CpuPlan::values`]: the channels, padded.
    pub fn pitch(&self, map: MapId) -> usize {
        padded(self.shapes[map.0].channels)
    }

    /// A map that the caller wrote or had kept; others may have been overwritten. Rows of positions, the channels of a position side by
    /// side and padded.
    pub fn values(&self, map: MapId) -> &[f32] {
        &self.buffers[self.slots[map.0]].values()[..self.length(map)]
    }

    fn length(&self, map: MapId) -> usize {
        let MapShape { height, width, .. } = self.shapes[map.0];
        height * width * self.pitch(map)
    }

    /// A map to write. The padding of channels is zero and has to stay so.
    pub fn values_mut(&mut self, map: MapId) -> &mut [f32] {
        let length = self.length(map);
        &mut self.buffers[self.slots[map.0]].values_mut()[..length]
    }

    /// Number of threads.
    pub fn threads(&self) -> usize {
        self.scratches.len()
    }

    /// Number of steps.
    pub fn steps(&self) -> usize {
        self.work.len()
    }

    /// Runs the steps `steps`.
    ///
    /// # Panics
    /// When the plan has fewer steps.
    pub fn run(&mut self, steps: Range<usize>) {
        for step in steps {
            let (work, output) = &self.work[step];
            let (output, shape) = (self.slots[output.0], self.shapes[output.0]);
            let mut out = std::mem::take(&mut self.buffers[output]);
            let maps = Maps {
                shapes: &self.shapes,
                slots: &self.slots,
                buffers: &self.buffers,
            };
            let row = shape.width * padded(shape.channels);
            let values = &mut out.values_mut()[..shape.height * row];
            match work {
                Work::Layer(layer) => layer.run(self.arch, maps, &mut self.scratches, &mut self.shared, values),
                Work::Pool(pool) => {
                    let rows = 0..shape.height;
                    in_bands(&mut self.scratches, rows, Units::whole(values, row), &|_, rows, out| {
                        self.arch.dispatch(Pooled {
                            pool: *pool,
                            map: maps.view(pool.map),
                            output: shape,
                            rows,
                            out: out.values,
                        });
                    });
                }
                Work::Dense(dense) => {
                    let read = maps.view(dense.map).values;
                    let blocks = 0..dense.blocks();
                    in_bands(
                        &mut self.scratches,
                        blocks,
                        Units::whole(values, BLOCK),
                        &|_, blocks, out| {
                            dense.run(self.arch, read, blocks, out.values);
                        },
                    );
                }
                Work::Add(map, added) => add(&maps, *map, *added, values),
            }
            self.buffers[output] = out;
        }
    }
}

/// Numbers in a vector of this processor.
#[derive(Debug)]
pub struct Lanes;

impl WithSimd for Lanes {
    type Output = usize;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> usize {
        S::F32_LANES
    }
}

fn add(maps: &Maps<'_>, map: MapId, added: Added, out: &mut [f32]) {
    let map = maps.view(map);
    let (pitch, width) = (map.pitch(), map.shape.width);
    let Added {
        map: added,
        factor,
        top,
    } = added;
    let added = maps.view(added);
    for (place, (out, a)) in out
        .chunks_exact_mut(pitch)
        .zip(map.values.chunks_exact(pitch))
        .enumerate()
    {
        let (y, x) = ((place / width + top) / factor, place % width / factor);
        let b = &added.values[(y * added.shape.width + x) * pitch..][..pitch];
        for (out, (a, b)) in out.iter_mut().zip(a.iter().zip(b)) {
            *out = a + b;
        }
    }
}
