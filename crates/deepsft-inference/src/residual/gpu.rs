//! The paper's network on a GPU.

use super::network::ResidualPlan;
use crate::config::NetworkConfig;
use crate::gpu::shader::Shader;
use crate::gpu::{FramePipeline, Gpu, GpuError, GpuPlan};
use crate::weights::Weights;
use deepsft_geometry::{CANONICAL_HEIGHT, CANONICAL_WIDTH};

/// Values -1..=1 of the image's pixels.
const COLORS: &str = "
var value = vec4f();
for (var k = 0u; k < 3u; k++) {
    let at = 3u * index + k;
    value[k] = f32((image[at / 4u] >> (8u * (at % 4u))) & 255u) * (2.0 / 255.0) - 1.0;
}
out[index] = value;";

/// The paper's network on a GPU, for images of 480 x 270 pixels. A frame is one list of work; what comes back are
/// [`ResidualPlan::outputs`].
pub(crate) fn residual_pipeline(
    gpu: &Gpu,
    config: &NetworkConfig,
    weights: &Weights,
) -> Result<FramePipeline, GpuError> {
    let ResidualPlan { plan, image, outputs } = ResidualPlan::new(config, weights)?;
    let plan = GpuPlan::new(gpu, plan, &outputs);
    let size = [CANONICAL_WIDTH, CANONICAL_HEIGHT];
    let pixels = FramePipeline::pixels(gpu, size);
    let mut shader = Shader::default();
    shader.bind_as("image", "read", "u32", &pixels);
    shader.bind("out", "read_write", plan.buffer(image));
    let colors = shader.kernel(gpu, "", COLORS, CANONICAL_WIDTH * CANONICAL_HEIGHT, 1);
    let work = [vec![colors], plan.kernels(0..plan.steps())].concat();
    let results = outputs.iter().map(|&map| plan.buffer(map).clone()).collect();
    Ok(FramePipeline::new(gpu, work, (size, pixels), results))
}
