//! The paper's network and R50F as plans.

use crate::config::{Architecture, NetworkConfig, PaperConfig, R50FConfig};
use crate::plan::{DenseLayer, LayerInput, MapId, MapShape, MaxPool, Plan, PlanError, SkipInput};
use crate::weights::{PlanBuilder, Weights};
use deepsft_geometry::{CANONICAL_HEIGHT, CANONICAL_WIDTH};

/// The paper's network or R50F as a plan, and the maps at which the caller writes and reads.
pub(crate) struct ResidualPlan {
    pub(crate) plan: Plan,
    /// The image, the caller's: values -1..=1.
    pub(crate) image: MapId,
    /// What it ends with. The paper's network: depth, u and v of the main block; the refined depth; corrections of u and v. R50F: one
    /// map, of all depths, all u and all v, row after row.
    pub(crate) outputs: Vec<MapId>,
}

/// Stride and up-sampling of the first block of a stack.
type Resizing = (usize, usize);
const KEPT: Resizing = (1, 1);
const STRIDE: Resizing = (2, 1);
const UP_SAMPLING: Resizing = (1, 2);

/// Layers whose widths are divided.
struct ResidualBuilder<'a> {
    builder: PlanBuilder<'a>,
    divisor: usize,
}

impl ResidualPlan {
    pub(crate) fn new(config: &NetworkConfig, weights: &Weights) -> Result<Self, PlanError> {
        match &config.architecture {
            Architecture::Paper(layers) => Self::paper(layers, weights),
            Architecture::R50F(layers) => Self::r50f(layers, weights),
            Architecture::Compact(_) => Err(PlanError::Architecture(config.architecture.name())),
        }
    }

    fn paper(config: &PaperConfig, weights: &Weights) -> Result<Self, PlanError> {
        let (mut network, image) = ResidualBuilder::new(config.width_divisor, weights);
        let main = network.main_block(image)?;
        let seen = [image.plain(), main.plain()];
        let depth = network.refinement_block("depth_refinement", &seen, 1)?;
        let correction = network.refinement_block("registration_refinement", &seen, 2)?;
        let outputs = vec![main, depth, correction];
        let plan = network.builder.finish()?;
        Ok(Self { plan, image, outputs })
    }

    fn r50f(config: &R50FConfig, weights: &Weights) -> Result<Self, PlanError> {
        let (mut network, image) = ResidualBuilder::new(config.width_divisor, weights);
        let x = network.entry("", &[image.plain()], [2, 1])?;
        let x = network.stack("encode2", x, [64, 64, 256], KEPT, 2, [0, 0])?;
        let x = network.stack("encode3", x, [128, 128, 512], STRIDE, 3, [0, 0])?;
        let x = network.stack("encode4", x, [256, 256, 1024], STRIDE, 5, [0, 0])?;
        let widths = [512, 512, R50FConfig::ENCODED_CHANNELS];
        let x = network.stack("encode5", x, widths, STRIDE, 2, [0, 0])?;
        let neurons = config.neurons / config.width_divisor;
        let x = network.dense("neurons", x.map, neurons, true)?;
        let outputs = vec![network.dense("maps", x, R50FConfig::MAP_VALUES, false)?];
        let plan = network.builder.finish()?;
        Ok(Self { plan, image, outputs })
    }
}

impl<'a> ResidualBuilder<'a> {
    /// With the image.
    fn new(divisor: usize, weights: &'a Weights) -> (Self, MapId) {
        let mut builder = PlanBuilder::new(weights, 1.0);
        let image = builder.plan.input(MapShape::new(3, CANONICAL_HEIGHT, CANONICAL_WIDTH));
        (Self { builder, divisor }, image)
    }

    /// Image -> depth, u, v.
    fn main_block(&mut self, image: MapId) -> Result<MapId, PlanError> {
        let x = self.entry("main.", &[image.plain()], [3, 0])?;
        let x = self.stack("main.encode2", x, [64, 64, 256], KEPT, 2, [0, 0])?;
        let x = self.stack("main.encode3", x, [128, 128, 512], STRIDE, 3, [0, 0])?;
        let x = self.stack("main.encode4", x, [256, 256, 1024], STRIDE, 5, [0, 0])?;
        let x = self.stack("main.decode5", x, [1024, 1024, 256], KEPT, 5, [0, 0])?;
        let x = self.stack("main.decode6", x, [512, 512, 128], UP_SAMPLING, 3, [0, 1])?;
        let x = self.stack("main.decode7", x, [256, 256, 64], UP_SAMPLING, 2, [0, 0])?;
        let (seen, shape) = ([upsampled(x, 3, [1, 1])], [64 / self.divisor, 7, 1]);
        let x = self.builder.relu_layer(&seen, "main.smooth", shape, None)?;
        let seen = [upsampled(x.plain(), 2, [1, 1])];
        self.builder.layer(&seen, "main.output", [3, 3, 1], None)
    }

    /// Image, depth, u and v -> `outputs` values of each pixel.
    fn refinement_block(&mut self, name: &str, seen: &[LayerInput], outputs: usize) -> Result<MapId, PlanError> {
        let x = self.entry(&format!("{name}."), seen, [3, 0])?;
        let x = self.stack(&format!("{name}.encode2"), x, [64, 64, 256], KEPT, 2, [0, 0])?;
        let x = self.stack(&format!("{name}.encode3"), x, [128, 128, 512], STRIDE, 3, [0, 0])?;
        let x = self.stack(&format!("{name}.decode6"), x, [512, 512, 128], UP_SAMPLING, 3, [0, 0])?;
        let x = self.stack(&format!("{name}.decode7"), x, [256, 256, 64], UP_SAMPLING, 2, [1, 1])?;
        let (seen, shape) = ([upsampled(x, 3, [0, 0])], [outputs, 3, 1]);
        self.builder.layer(&seen, &format!("{name}.output"), shape, None)
    }

    /// A 7 x 7 convolution and a pooling of this stride and border.
    fn entry(&mut self, path: &str, xs: &[LayerInput], [stride, border]: [usize; 2]) -> Result<LayerInput, PlanError> {
        let shape = [64 / self.divisor, 7, 2];
        let map = self.builder.relu_layer(xs, &format!("{path}entry"), shape, None)?;
        let map = self.builder.plan.pool(MaxPool { map, stride, border });
        Ok(map.plain())
    }

    /// A first block, whose result is read with `cropped` rows left out, and identity blocks.
    fn stack(
        &mut self,
        name: &str,
        x: LayerInput,
        widths: [usize; 3],
        resizing: Resizing,
        identities: usize,
        cropped: [usize; 2],
    ) -> Result<LayerInput, PlanError> {
        let widths = widths.map(|width| width / self.divisor);
        let mut x = self.bottleneck(&format!("{name}.first"), x, widths, Some(resizing))?;
        x.cropped = cropped;
        for k in 0..identities {
            x = self.bottleneck(&format!("{name}.identities.{k}"), x, widths, None)?;
        }
        Ok(x)
    }

    /// 1 x 1, 3 x 3 and 1 x 1 convolutions; what came in is added, and relu. With `resizing` it goes through a convolution before.
    fn bottleneck(
        &mut self,
        name: &str,
        x: LayerInput,
        [reduced, spatial, expanded]: [usize; 3],
        resizing: Option<Resizing>,
    ) -> Result<LayerInput, PlanError> {
        let (builder, (stride, factor)) = (&mut self.builder, resizing.unwrap_or(KEPT));
        let layer = |layer: &str| format!("{name}.{layer}");
        let branch = builder.relu_layer(&[x], &layer("reduce"), [reduced, 1, stride], None)?;
        let branch = upsampled(branch.plain(), factor, [0, 0]);
        let branch = builder.relu_layer(&[branch], &layer("spatial"), [spatial, 3, 1], None)?;
        let (map, top) = match resizing {
            Some(_) => (builder.layer(&[x], &layer("shortcut"), [expanded, 1, stride], None)?, 0),
            None => (x.map, x.cropped[0]),
        };
        let skip = Some(SkipInput { map, factor, top });
        let sum = builder.relu_layer(&[branch.plain()], &layer("expand"), [expanded, 1, 1], skip)?;
        Ok(sum.plain())
    }

    fn dense(&mut self, name: &str, map: MapId, outputs: usize, rectified: bool) -> Result<MapId, PlanError> {
        let read = self.builder.plan.shape(map);
        let shape = [read.channels * read.area(), outputs];
        let weights = self.builder.array(&format!("{name}.weight"), &shape)?.to_vec();
        let biases = self.builder.array(&format!("{name}.bias"), &[outputs])?.to_vec();
        self.builder.plan.dense(DenseLayer {
            map,
            weights,
            biases,
            rectified,
        })
    }
}

fn upsampled(x: LayerInput, factor: usize, cropped: [usize; 2]) -> LayerInput {
    LayerInput { factor, cropped, ..x }
}
