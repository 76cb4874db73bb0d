//! A plan on a GPU.

use super::convolution;
use super::device::Gpu;
use super::shader::{GpuMap, Kernel, padded};
use super::simple;
use crate::plan::{MapId, MapShape, Operation, Plan, SkipInput, Step};
use std::ops::Range;
use wgpu::Buffer;

/// A plan on a GPU with its shaders, filters and maps on a GPU. A run makes nothing new there but the list of its work.
#[derive(Debug)]
pub(crate) struct GpuPlan {
    shapes: Vec<MapShape>,
    /// The buffer of each map; maps that are not needed at the same time share one.
    slots: Vec<usize>,
    buffers: Vec<Buffer>,
    /// Of each step.
    kernels: Vec<Vec<Kernel>>,
}

impl GpuPlan {
    /// Prepares `plan` for a GPU. The maps `kept` can be read after the last step, as can those that the caller writes. What the GPU
    /// refuses, the first run reports.
    pub(crate) fn new(gpu: &Gpu, plan: Plan, kept: &[MapId]) -> Self {
        let (slots, sizes) = plan.shared_buffers(kept, padded);
        let Plan { maps: shapes, steps } = plan;
        let buffers: Vec<Buffer> = sizes.into_iter().map(|size| gpu.zeros(size)).collect();
        let needed = steps.iter().map(|step| match &step.operation {
            Operation::Convolve(convolution) => convolution::scratch(convolution, &shapes, shapes[step.output.0]),
            Operation::Add(..) | Operation::Pool(_) | Operation::Dense(_) => [4, 4],
        });
        let most = needed.fold([4, 4], |most, needed| [0, 1].map(|k| most[k].max(needed[k])));
        let scratch = most.map(|length| gpu.zeros(length));
        // What comes and goes with f32 stays so; between layers 16 bits are enough.
        let inner = |map: MapId| steps.iter().any(|step| step.output == map) && !kept.contains(&map);
        let view = |map: MapId| GpuMap {
            shape: shapes[map.0],
            half: gpu.has_f16() && inner(map),
            buffer: &buffers[slots[map.0]],
        };
        let skipped = |skip: SkipInput| (view(skip.map), skip);
        let of_step = |step: &Step| {
            let output = view(step.output);
            match &step.operation {
                Operation::Convolve(convolution) => {
                    let inputs = convolution.inputs.iter();
                    let sources: Vec<_> = inputs.map(|&input| (view(input.map), input)).collect();
                    let skip = convolution.skip.map(skipped);
                    convolution::kernels(gpu, (convolution, &shapes), &sources, skip, output, &scratch)
                }
                Operation::Pool(pool) => vec![simple::pool(gpu, pool, view(pool.map), output)],
                // Only R50F has these, which `GpuExecutor` refuses.
                Operation::Dense(_) => Vec::new(),
                Operation::Add(map, skip) => vec![simple::sum(gpu, view(*map), skipped(*skip), output)],
            }
        };
        Self {
            kernels: steps.iter().map(of_step).collect(),
            shapes,
            slots,
            buffers,
        }
    }

    pub(crate) fn steps(&self) -> usize {
        self.kernels.len()
    }

    pub(crate) fn shape(&self, map: MapId) -> MapShape {
        self.shapes[map.0]
    }

    pub(crate) fn buffer(&self, map: MapId) -> &Buffer {
        &self.buffers[self.slots[map.0]]
    }

    /// The work of the steps `steps`, which keeps the plan's buffers.
    pub(crate) fn kernels(&self, steps: Range<usize>) -> Vec<Kernel> {
        self.kernels[steps].concat()
    }
}
