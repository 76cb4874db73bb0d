//! Depth and Registration Refinement Blocks (paper, table "Depth and Registration Refinement Block architectures").

use crate::description::LayerTable;
use crate::fold::{Fold, folded};
use crate::resnet::{NormalisedConvolution, Resizing, Stack, WeightInit, max_pool};
use crate::upsampling::upsample_nearest;
use burn::module::Module;
use burn::tensor::{Tensor, activation::relu};

/// The main block's first two encoder stacks and last two decoder stacks, with a map of twice the size in the end.
#[derive(Module, Debug)]
pub struct PaperRefinementBlock {
    entry: NormalisedConvolution,
    encode2: Stack,
    encode3: Stack,
    decode6: Stack,
    decode7: Stack,
    output: NormalisedConvolution,
}

impl PaperRefinementBlock {
    /// Layers of `1 / divisor` of the paper's widths, saying `outputs` values per pixel: 1 for depth, 2 for registration.
    pub fn new(divisor: usize, outputs: usize, init: WeightInit) -> Self {
        let width = |paper: usize| paper / divisor;
        use Resizing::{Kept, Stride, UpSampling};
        let stack = Stack::narrowed(divisor, init);
        Self {
            entry: NormalisedConvolution::new([6, width(64)], 7, 2, init),
            encode2: stack(64, [64, 64, 256], Kept, 2),
            encode3: stack(256, [128, 128, 512], Stride(2), 3),
            decode6: stack(512, [512, 512, 128], UpSampling(2), 3),
            decode7: stack(128, [256, 256, 64], UpSampling(2), 2).cropped(1, 90),
            output: NormalisedConvolution::plain([width(64), outputs], 3, init),
        }
    }

    /// Image, depth and registration [N, 6, 270, 480] -> [N, outputs, 270, 480].
    pub fn forward(&self, seen: Tensor<4>) -> Tensor<4> {
        let x = max_pool(relu(self.entry.forward(seen)), 3, 0); // [N, 64, 45, 80]
        let x = self.encode3.forward(self.encode2.forward(x)); // [N, 512, 23, 40]
        let x = self.decode7.forward(self.decode6.forward(x)); // [N, 64, 90, 160]
        self.output.forward(upsample_nearest(x, 3))
    }

    /// Writes its layers into `table`, which holds image, depth and registration.
    pub fn describe(&self, table: &mut LayerTable) {
        self.entry.describe("conv1", table);
        table.resize("max pool 3x3 stride 3", 45, 80);
        for (name, stack) in [
            ("enc2", &self.encode2),
            ("enc3", &self.encode3),
            ("dec6", &self.decode6),
            ("dec7", &self.decode7),
        ] {
            stack.describe(name, table);
        }
        table.resize("up-sampling x3", 270, 480);
        self.output.describe("output", table);
    }
}

impl Fold for PaperRefinementBlock {
    fn fold(self) -> Self {
        folded!(self, [entry, encode2, encode3, decode6, decode7, output], [])
    }
}
