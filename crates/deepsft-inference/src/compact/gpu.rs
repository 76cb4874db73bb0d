//! The compact network on a GPU.

use super::cells::cells;
use super::depths::{MOMENTS, REACHES, gaussian};
use super::network::CompactPlan;
use super::shaders;
use crate::config::NetworkConfig;
use crate::gpu::shader::Shader;
use crate::gpu::{FramePipeline, Gpu, GpuError, GpuPlan, Kernel};
use crate::plan::{MapId, MapShape, Plan, PlanError};
use crate::weights::Weights;
use wgpu::Buffer;

/// Steps of a plan that average moments under the windows: down the columns, and across for each reach.
struct Windows {
    moments: MapId,
    down: MapId,
    turned: [MapId; 2],
    means: [MapId; 2],
    /// The step down; those across follow it.
    first: usize,
}

impl Windows {
    /// Averaging is a product with a matrix: a convolution whose channels are the rows, then the columns.
    fn new(plan: &mut Plan, [rows, columns]: [usize; 2]) -> Result<Self, PlanError> {
        let blend = |plan: &mut Plan, map: MapId, reaches: &[f64], length: usize| {
            let windows = reaches.iter().flat_map(|&reach| gaussian(length, reach));
            plan.multiply(map, windows.collect())
        };
        let shape = |channels, width| MapShape::new(channels, MOMENTS, width);
        let first = plan.steps();
        let moments = plan.input(shape(rows, columns));
        let down = blend(plan, moments, &REACHES, rows)?;
        let turned = REACHES.map(|_| plan.input(shape(columns, rows)));
        let [narrow, wide] = REACHES;
        let means = [
            blend(plan, turned[0], &[narrow], columns)?,
            blend(plan, turned[1], &[wide], columns)?,
        ];
        Ok(Self {
            moments,
            down,
            turned,
            means,
            first,
        })
    }
}

/// A compact network on a GPU, for images of one size. A frame is one list of work; what comes back are the coordinates of cells, the
/// refined ones, each in a quad, and the mask's logits: [quad, patch, 4].
pub(crate) fn compact_pipeline(
    gpu: &Gpu,
    config: &NetworkConfig,
    image: [usize; 2],
    weights: &Weights,
) -> Result<FramePipeline, GpuError> {
    let mut network = CompactPlan::new(image, config, weights)?;
    let mut plan = std::mem::take(&mut network.plan);
    let last = plan.steps();
    let [rows, columns] = cells(image);
    let windows = if network.layers.has_rest_positions() {
        None
    } else {
        Some(Windows::new(&mut plan, [rows, columns])?)
    };
    let mut kept = [&[network.bins, network.offset, network.mask][..], &network.corrections].concat();
    kept.extend(windows.iter().flat_map(|w| [w.down, w.means[0], w.means[1]]));
    let plan = GpuPlan::new(gpu, plan, &kept);

    let count = rows * columns;
    let (pixels, coarse) = (FramePipeline::pixels(gpu, image), gpu.zeros(count));
    let [found, refined, measured] = [(); 3].map(|()| gpu.zeros(4 * count));
    let frame = FrameKernels {
        gpu,
        network: &network,
        plan: &plan,
        constants: shaders::constants(config),
        cells: [rows, columns],
        found: &found,
        refined: &refined,
        measured: &measured,
    };
    let [depth, registration] = network.marks;
    let mut work = vec![frame.patches(image, &pixels)];
    work.extend(plan.kernels(0..depth));
    work.extend([frame.positions(&coarse), frame.cells(&coarse, windows.as_ref())]);
    if let Some(windows) = &windows {
        work.extend(plan.kernels(windows.first..windows.first + 1));
        work.push(frame.turn(windows));
        work.extend(plan.kernels(windows.first + 1..windows.first + 3));
    }
    work.push(frame.measure(windows.as_ref()));
    work.extend(plan.kernels(depth..registration));
    work.push(frame.refine_depth());
    work.extend(plan.kernels(registration..last));
    work.push(frame.refine_registration());
    let results = vec![found, refined, plan.buffer(network.mask).clone()];
    Ok(FramePipeline::new(gpu, work, (image, pixels), results))
}

/// One of the 16 logits of a patch that came back.
pub(crate) fn logit(logits: &[f32], patch: usize, within: usize) -> f32 {
    logits[within / 4 * (logits.len() / 4) + 4 * patch + within % 4]
}

/// Writes the kernels of a frame.
struct FrameKernels<'a> {
    gpu: &'a Gpu,
    network: &'a CompactPlan,
    plan: &'a GpuPlan,
    constants: String,
    cells: [usize; 2],
    found: &'a Buffer,
    refined: &'a Buffer,
    measured: &'a Buffer,
}

impl FrameKernels<'_> {
    /// A kernel with an invocation for each cell.
    fn of_cells(&self, mut shader: Shader<'_>, functions: &[&str], body: &str) -> Kernel {
        let [rows, columns] = self.cells;
        shader.sizes([("rows", rows), ("columns", columns)]);
        let functions = self.constants.clone() + &functions.concat();
        shader.kernel(self.gpu, &functions, body, rows * columns, 1)
    }

    fn patches(&self, [width, height]: [usize; 2], pixels: &Buffer) -> Kernel {
        let shape = self.plan.shape(self.network.image);
        let mut shader = Shader::default();
        shader.bind_as("image", "read", "u32", pixels);
        shader.bind("out", "read_write", self.plan.buffer(self.network.image));
        shader.sizes([("width", width), ("height", height)]);
        shader.size("across", shape.width);
        shader.size("patches", shape.area());
        let count = shape.channels / 4 * shape.area();
        shader.kernel(self.gpu, "", shaders::PATCHES, count, 1)
    }

    fn positions(&self, coarse: &Buffer) -> Kernel {
        let mut shader = Shader::default();
        shader.bind_as("bins", "read", "f32", self.plan.buffer(self.network.bins));
        shader.bind("out", "read_write", coarse);
        let names = ["bins_u", "bins_v", "bins_d", "bins_z"].into_iter();
        for (name, &bins) in names.zip(self.network.layers.bins.iter().chain([&0])) {
            shader.size(name, bins);
        }
        let [rows, columns] = self.cells;
        let functions = self.constants.clone() + shaders::POSITION_FUNCTIONS;
        shader.kernel(self.gpu, &functions, shaders::POSITIONS, rows * columns / 4, 1)
    }

    fn cells(&self, coarse: &Buffer, windows: Option<&Windows>) -> Kernel {
        let mut shader = Shader::default();
        shader.bind("coarse", "read", coarse);
        shader.bind("offset", "read", self.plan.buffer(self.network.offset));
        shader.bind("mask", "read", self.plan.buffer(self.network.mask));
        shader.bind("out", "read_write", self.found);
        let mut body = shaders::CELLS.to_owned();
        let mut functions = vec![shaders::CELL_FUNCTIONS];
        if let Some(windows) = windows {
            shader.bind_as("moments", "read_write", "f32", self.plan.buffer(windows.moments));
            functions.push(shaders::MOMENT_FUNCTION);
            body += shaders::MOMENTS_OF_CELLS;
        }
        self.of_cells(shader, &functions, &body)
    }

    fn turn(&self, windows: &Windows) -> Kernel {
        let [rows, columns] = self.cells;
        let mut shader = Shader::default();
        shader.bind_as("down", "read", "f32", self.plan.buffer(windows.down));
        shader.bind("narrow", "read_write", self.plan.buffer(windows.turned[0]));
        shader.bind("wide", "read_write", self.plan.buffer(windows.turned[1]));
        shader.sizes([("rows", rows), ("columns", columns)]);
        let count = columns.div_ceil(4) * MOMENTS * rows;
        shader.kernel(self.gpu, &self.constants, shaders::TURN, count, REACHES.len())
    }

    fn measure(&self, windows: Option<&Windows>) -> Kernel {
        let mut shader = Shader::default();
        shader.bind("found", "read", self.found);
        shader.bind("measured", "read_write", self.measured);
        shader.bind("cues", "read_write", self.plan.buffer(self.network.cues[0]));
        let mut body = shaders::MEASURE_WITHOUT_PLANES;
        if let Some(windows) = windows {
            shader.bind_as("narrow", "read", "f32", self.plan.buffer(windows.means[0]));
            shader.bind_as("wide", "read", "f32", self.plan.buffer(windows.means[1]));
            body = shaders::MEASURE;
        }
        self.of_cells(shader, &[shaders::CUE_FUNCTIONS, shaders::MEASURE_FUNCTIONS], body)
    }

    fn refine_depth(&self) -> Kernel {
        let mut shader = Shader::default();
        shader.bind("found", "read", self.found);
        shader.bind("measured", "read", self.measured);
        shader.bind("correction", "read", self.plan.buffer(self.network.corrections[0]));
        shader.bind("out", "read_write", self.refined);
        shader.bind("cues", "read_write", self.plan.buffer(self.network.cues[1]));
        self.of_cells(shader, &[shaders::CUE_FUNCTIONS], shaders::REFINE_DEPTH)
    }

    fn refine_registration(&self) -> Kernel {
        let mut shader = Shader::default();
        shader.bind("correction", "read", self.plan.buffer(self.network.corrections[1]));
        shader.bind("out", "read_write", self.refined);
        self.of_cells(shader, &[], shaders::REFINE_REGISTRATION)
    }
}
