//! Main Block: image -> depth and registration (paper, table "Main Block architecture").

use crate::description::LayerTable;
use crate::fold::{Fold, folded};
use crate::resnet::{NormalisedConvolution, Resizing, Stack, WeightInit, crop_rows, max_pool};
use crate::upsampling::upsample_nearest;
use burn::module::Module;
use burn::tensor::{Tensor, activation::relu};

/// A ResNet-50 encoder to stride 24 and its mirror image, by batch-normalised blocks of [`super::super::resnet`].
#[derive(Module, Debug)]
pub struct PaperMainBlock {
    entry: NormalisedConvolution,
    encode2: Stack,
    encode3: Stack,
    encode4: Stack,
    decode5: Stack,
    decode6: Stack,
    decode7: Stack,
    smooth: NormalisedConvolution,
    output: NormalisedConvolution,
}

impl PaperMainBlock {
    /// Layers of `1 / divisor` of the paper's widths.
    pub fn new(divisor: usize, init: WeightInit) -> Self {
        let width = |paper: usize| paper / divisor;
        use Resizing::{Kept, Stride, UpSampling};
        let stack = Stack::narrowed(divisor, init);
        Self {
            entry: NormalisedConvolution::new([3, width(64)], 7, 2, init),
            encode2: stack(64, [64, 64, 256], Kept, 2),
            encode3: stack(256, [128, 128, 512], Stride(2), 3),
            encode4: stack(512, [256, 256, 1024], Stride(2), 5),
            decode5: stack(1024, [1024, 1024, 256], Kept, 5),
            decode6: stack(256, [512, 512, 128], UpSampling(2), 3).cropped(0, 23),
            decode7: stack(128, [256, 256, 64], UpSampling(2), 2),
            smooth: NormalisedConvolution::new([width(64), width(64)], 7, 1, init),
            output: NormalisedConvolution::plain([width(64), 3], 3, init),
        }
    }

    /// [N, 3, 270, 480], values -1..=1 -> depth and registration, [N, 3, 270, 480].
    pub fn forward(&self, images: Tensor<4>) -> Tensor<4> {
        let x = max_pool(relu(self.entry.forward(images)), 3, 0); // [N, 64, 45, 80]
        let x = self.encode3.forward(self.encode2.forward(x)); // [N, 512, 23, 40]
        let x = self.decode5.forward(self.encode4.forward(x)); // [N, 256, 12, 20]
        let x = self.decode7.forward(self.decode6.forward(x)); // [N, 64, 46, 80]
        let x = crop_rows(upsample_nearest(x, 3), 1, 136); // [N, 64, 136, 240]
        let x = relu(self.smooth.forward(x));
        let x = crop_rows(upsample_nearest(x, 2), 1, 270); // [N, 64, 270, 480]
        self.output.forward(x)
    }

    /// Writes its layers into `table`, which holds an image.
    pub fn describe(&self, table: &mut LayerTable) {
        self.entry.describe("conv1", table);
        table.resize("max pool 3x3 stride 3", 45, 80);
        for (name, stack) in [
            ("enc2", &self.encode2),
            ("enc3", &self.encode3),
            ("enc4", &self.encode4),
            ("dec5", &self.decode5),
            ("dec6", &self.decode6),
            ("dec7", &self.decode7),
        ] {
            stack.describe(name, table);
        }
        table.resize("up-sampling x3, crop", 136, 240);
        self.smooth.describe("conv8", table);
        table.resize("up-sampling x2, crop", 270, 480);
        self.output.describe("output", table);
    }
}

impl Fold for PaperMainBlock {
    fn fold(self) -> Self {
        folded!(
            self,
            [
                entry, encode2, encode3, encode4, decode5, decode6, decode7, smooth, output
            ],
            []
        )
    }
}
