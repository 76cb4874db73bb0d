//! Bottleneck blocks in the form of Keras' ResNet-50, which the paper builds on (figure "blocks"), and stacks of them.

use crate::convolution_layer::Convolution;
use crate::description::{Cost, LayerTable};
use crate::resampling::{crop_rows, upsample_nearest};
use crate::weight_init::WeightInit;
use burn::module::Module;
use burn::tensor::{Tensor, activation::relu};

/// 1x1, 3x3 and 1x1 convolutions, each with batch normalisation, ReLU between them and after the sum with what came in.
///
/// * *Identity block*: what came in is added as it is.
/// * *Convolutional block*: it goes through a 1x1 convolution with batch normalisation first, since the width or (by a
///   stride in both 1x1 convolutions) the size changes.
/// * *Decoding block*: a convolutional block after nearest up-sampling.
///
/// A 1x1 convolution, batch normalisation and ReLU act on each pixel alone, so they commute with nearest up-sampling: a
/// decoding block runs its two incoming 1x1 convolutions before it and saves three quarters of their cost.
#[derive(Module, Debug)]
pub struct Bottleneck {
    reduce: Convolution,
    spatial: Convolution,
    expand: Convolution,
    shortcut: Option<Convolution>,
    upsampling: usize,
}

impl Bottleneck {
    /// The identity block of `widths` (1x1, 3x3, 1x1); the last is also what comes in.
    pub fn identity(widths: [usize; 3], init: WeightInit) -> Self {
        let mut block = Self::convolutional(widths[2], widths, 1, 1, init);
        block.shortcut = None;
        block
    }

    /// The convolutional block (`upsampling` 1) or decoding block (`upsampling` 2) from `inputs` channels to
    /// `widths[2]`.
    pub fn convolutional(
        inputs: usize,
        [reduced, spatial, expanded]: [usize; 3],
        stride: usize,
        upsampling: usize,
        init: WeightInit,
    ) -> Self {
        Self {
            reduce: Convolution::normalised([inputs, reduced], 1, stride, init),
            spatial: Convolution::normalised([reduced, spatial], 3, 1, init),
            expand: Convolution::normalised([spatial, expanded], 1, 1, init),
            shortcut: Some(Convolution::normalised([inputs, expanded], 1, stride, init)),
            upsampling,
        }
    }

    /// [N, in, H, W] -> [N, out, H', W'] with H' = upsampling ceil(H / stride).
    pub fn forward(&self, x: Tensor<4>) -> Tensor<4> {
        let branch = relu(self.reduce.forward(x.clone()));
        let branch = upsample_nearest(branch, self.upsampling);
        let branch = self.expand.forward(relu(self.spatial.forward(branch)));
        let kept = match &self.shortcut {
            Some(shortcut) => upsample_nearest(shortcut.forward(x), self.upsampling),
            None => x,
        };
        relu(branch + kept)
    }

    /// Rows and columns of what comes out for a map of `rows` x `columns`.
    fn output(&self, [rows, columns]: [usize; 2]) -> [usize; 2] {
        let stride = self.reduce.stride();
        [rows, columns].map(|side| self.upsampling * side.div_ceil(stride))
    }

    /// Its cost where `pixels` pixels come out.
    fn cost(&self, pixels: usize) -> Cost {
        let early = [Some(&self.reduce), self.shortcut.as_ref()].into_iter().flatten();
        let late = [&self.spatial, &self.expand].into_iter();
        let saving = self.upsampling * self.upsampling;
        early
            .map(|layer| layer.cost(pixels, saving))
            .chain(late.map(|layer| layer.cost(pixels, 1)))
            .sum()
    }

    /// Widths of the 1x1, 3x3 and 1x1 convolutions, as a table names them.
    fn widths(&self) -> String {
        let [a, b, c] = [&self.reduce, &self.spatial, &self.expand].map(Convolution::channels);
        format!("({a}, {b}, {c})")
    }
}

/// A convolutional or decoding block, a crop and identity blocks.
#[derive(Module, Debug)]
pub struct Stack {
    first: Bottleneck,
    identities: Vec<Bottleneck>,
    #[module(skip)]
    crop: Option<(usize, usize)>,
}

impl Stack {
    /// What makes stacks of `1 / divisor` of the widths it is told: the channels that come in, the widths of the 1x1, 3x3
    /// and 1x1 convolutions of each block, stride and nearest up-sampling of the first block, and the number of identity blocks after
    /// it.
    pub fn narrowed(divisor: usize, init: WeightInit) -> impl Fn(usize, [usize; 3], [usize; 2], usize) -> Self {
        move |inputs, widths, [stride, upsampling], identities| {
            let widths = widths.map(|width| width / divisor);
            Self {
                first: Bottleneck::convolutional(inputs / divisor, widths, stride, upsampling, init),
                identities: (0..identities).map(|_| Bottleneck::identity(widths, init)).collect(),
                crop: None,
            }
        }
    }

    /// The stack whose identity blocks see `height` rows of the first block's map, from the row `top` on.
    pub fn cropped(mut self, top: usize, height: usize) -> Self {
        self.crop = Some((top, height));
        self
    }

    /// [N, in, H, W] -> [N, out, H', W'].
    pub fn forward(&self, x: Tensor<4>) -> Tensor<4> {
        let mut x = self.first.forward(x);
        if let Some((top, height)) = self.crop {
            x = crop_rows(x, top, height);
        }
        for block in &self.identities {
            x = block.forward(x);
        }
        x
    }

    /// Writes itself into `table` under `name`.
    pub fn describe(&self, name: &str, table: &mut LayerTable) {
        let [_, rows, columns] = table.size;
        let [mut rows, columns] = self.first.output([rows, columns]);
        let channels = self.first.expand.channels();
        let (widths, stride) = (self.first.widths(), self.first.reduce.stride());
        let kind = match (self.first.upsampling, stride) {
            (1, 1) => "convolutional block".to_owned(),
            (1, stride) => format!("convolutional block stride {stride}"),
            (factor, _) => format!("decoding block x{factor}"),
        };
        let cost = self.first.cost(rows * columns);
        table.add(format!("{name} {kind} {widths}"), [channels, rows, columns], cost);
        if let Some((_, height)) = self.crop {
            rows = height;
            table.resize(&format!("{name} crop"), rows, columns);
        }
        let cost = self.identities.iter().map(|block| block.cost(rows * columns)).sum();
        let name = format!("{name} {} identity blocks {widths}", self.identities.len());
        table.add(name, [channels, rows, columns], cost);
    }
}
