//! The paper's network and R50F on a GPU.

use super::network::ResidualPlan;
use super::output::{OutputMaps, read};
use crate::config::{DepthRange, NetworkConfig};
use crate::gpu::shader::Shader;
use crate::gpu::{FramePart, FramePipeline, Gpu, GpuError, GpuPlan};
use crate::plan::MapId;
use crate::stage::Stage;
use crate::weights::Weights;
use deepsft_geometry::{CANONICAL_HEIGHT, CANONICAL_WIDTH, GeometryError, Maps, Picture};

/// Values -1..=1 of the image's pixels.
const COLORS: &str = "
var value = vec4f();
for (var k = 0u; k < 3u; k++) {
    let at = 3u * index + k;
    value[k] = f32((image[at / 4u] >> (8u * (at % 4u))) & 255u) * (2.0 / 255.0) - 1.0;
}
out[index] = value;";

/// The paper's network or R50F on a GPU, for images of 480 x 270 pixels. A frame is one list of work. R50F at its full width has more
/// weights than GPUs bind at once: its first run fails.
#[derive(Debug)]
pub(crate) struct ResidualGpuExecutor {
    pipeline: FramePipeline,
    outputs: OutputMaps,
    range: DepthRange,
    /// What came back: the maps of what the network says, and their values.
    values: Vec<(MapId, Vec<f32>)>,
}

impl ResidualGpuExecutor {
    /// # Errors
    /// [`GpuError::Plan`] when `weights` are not those of `config`, and when that is of another architecture; others when the GPU
    /// failed before.
    pub(crate) fn new(gpu: &Gpu, config: &NetworkConfig, weights: &Weights) -> Result<Self, GpuError> {
        gpu.check()?;
        let ResidualPlan { plan, image, outputs } = ResidualPlan::new(config, weights)?;
        let plan = GpuPlan::new(gpu, plan, &outputs.maps());
        let size = [CANONICAL_WIDTH, CANONICAL_HEIGHT];
        let pixels = FramePipeline::pixels(gpu, size);
        let mut shader = Shader::default();
        shader.bind_as("image", "read", "u32", &pixels);
        shader.bind("out", "read_write", plan.buffer(image));
        let colors = shader.kernel(gpu, "", COLORS, CANONICAL_WIDTH * CANONICAL_HEIGHT, 1);
        let work = vec![FramePart::Kernel(colors), FramePart::Steps(0..plan.steps())];
        let results: Vec<_> = outputs.maps().iter().map(|&map| plan.buffer(map).clone()).collect();
        let values = outputs.maps().into_iter().zip(&results);
        let values = values.map(|(map, buffer)| (map, vec![0.0; buffer.size() as usize / 4]));
        Ok(Self {
            outputs,
            range: config.depth_range,
            values: values.collect(),
            pipeline: FramePipeline::new(gpu, plan, work, (size, pixels), results),
        })
    }

    /// See [`crate::GpuExecutor::run`].
    pub(crate) async fn run(&mut self, image: &Picture) -> Result<(), GpuError> {
        let values = self.values.iter_mut().flat_map(|(_, values)| values);
        let read =
            |numbers: &mut dyn Iterator<Item = f32>| values.zip(numbers).for_each(|(value, number)| *value = number);
        self.pipeline.run(image, read).await
    }

    /// See [`crate::GpuExecutor::read`].
    pub(crate) fn read(&self, stage: Stage, seen: Option<&[bool]>, maps: &mut Maps) -> Result<(), GeometryError> {
        let values = |map: MapId| {
            let found = self.values.iter().find(|(kept, _)| *kept == map);
            (found.map_or(&[][..], |(_, values)| values), 4)
        };
        read(self.outputs, self.range, values, (stage, seen), maps)
    }
}
