//! The blocks of the paper's network (tables "Main Block architecture" and "Depth and Registration Refinement Block architectures").

use crate::convolution_layer::Convolution;
use crate::description::LayerTable;
use crate::resampling::{crop_rows, max_pool, upsample_nearest};
use crate::resnet::Stack;
use crate::weight_init::WeightInit;
use burn::module::Module;
use burn::tensor::{Tensor, activation::relu};

/// A ResNet-50 encoder and its mirror image, by batch-normalised blocks of [`crate::resnet`]. A refinement block has the main block's first
/// two encoder stacks and last two decoder stacks, and a map of twice the size in the end.
#[derive(Module, Debug)]
pub struct PaperBlock {
    entry: Convolution,
    encode2: Stack,
    encode3: Stack,
    encode4: Option<Stack>,
    decode5: Option<Stack>,
    decode6: Stack,
    decode7: Stack,
    smooth: Option<Convolution>,
    output: Convolution,
}

impl PaperBlock {
    /// The Main Block, of `1 / divisor` of the paper's widths: image -> depth and registration.
    pub fn main(divisor: usize, init: WeightInit) -> Self {
        let (width, stack) = (64 / divisor, Stack::narrowed(divisor, init));
        Self {
            entry: Convolution::normalised([3, width], 7, 2, init),
            encode2: stack(64, [64, 64, 256], [1, 1], 2),
            encode3: stack(256, [128, 128, 512], [2, 1], 3),
            encode4: Some(stack(512, [256, 256, 1024], [2, 1], 5)),
            decode5: Some(stack(1024, [1024, 1024, 256], [1, 1], 5)),
            decode6: stack(256, [512, 512, 128], [1, 2], 3).cropped(0, 23),
            decode7: stack(128, [256, 256, 64], [1, 2], 2),
            smooth: Some(Convolution::normalised([width, width], 7, 1, init)),
            output: Convolution::plain([width, 3], 3, init),
        }
    }

    /// A refinement block that says `outputs` values per pixel, 1 for depth, 2 for registration: image, depth and registration ->
    /// these.
    pub fn refinement(divisor: usize, outputs: usize, init: WeightInit) -> Self {
        let (width, stack) = (64 / divisor, Stack::narrowed(divisor, init));
        Self {
            entry: Convolution::normalised([6, width], 7, 2, init),
            encode2: stack(64, [64, 64, 256], [1, 1], 2),
            encode3: stack(256, [128, 128, 512], [2, 1], 3),
            encode4: None,
            decode5: None,
            decode6: stack(512, [512, 512, 128], [1, 2], 3),
            decode7: stack(128, [256, 256, 64], [1, 2], 2).cropped(1, 90),
            smooth: None,
            output: Convolution::plain([width, outputs], 3, init),
        }
    }

    fn stacks(&self) -> impl Iterator<Item = (&'static str, &Stack)> {
        [
            ("enc2", Some(&self.encode2)),
            ("enc3", Some(&self.encode3)),
            ("enc4", self.encode4.as_ref()),
            ("dec5", self.decode5.as_ref()),
            ("dec6", Some(&self.decode6)),
            ("dec7", Some(&self.decode7)),
        ]
        .into_iter()
        .filter_map(|(name, stack)| stack.map(|stack| (name, stack)))
    }

    /// [N, 3 or 6, 270, 480], images -1..=1 -> [N, outputs, 270, 480].
    pub fn forward(&self, seen: Tensor<4>) -> Tensor<4> {
        let x = max_pool(relu(self.entry.forward(seen)), 3, 0); // [N, 64, 45, 80]
        let x = self.stacks().fold(x, |x, (_, stack)| stack.forward(x)); // [N, 64, 46, 80] or [N, 64, 90, 160]
        let mut x = upsample_nearest(x, 3);
        if let Some(smooth) = &self.smooth {
            x = relu(smooth.forward(crop_rows(x, 1, 136))); // [N, 64, 136, 240]
            x = crop_rows(upsample_nearest(x, 2), 1, 270);
        }
        self.output.forward(x)
    }

    /// Writes its layers into `table`, which holds what the block sees.
    pub fn describe(&self, table: &mut LayerTable) {
        self.entry.describe("conv1", table);
        table.resize("max pool 3x3 stride 3", 45, 80);
        self.stacks().for_each(|(name, stack)| stack.describe(name, table));
        if let Some(smooth) = &self.smooth {
            table.resize("up-sampling x3, crop", 136, 240);
            smooth.describe("conv8", table);
            table.resize("up-sampling x2, crop", 270, 480);
        } else {
            table.resize("up-sampling x3", 270, 480);
        }
        self.output.describe("output", table);
    }
}
