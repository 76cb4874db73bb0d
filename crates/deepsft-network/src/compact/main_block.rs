//! Main Block: an encoder-decoder over the image that finds the object (paper, section 3.2).

use super::bins::expected_coordinate;
use super::cells::PATCH;
use super::residual_block::ResidualBlock;
use crate::convolution_layer::{Convolution, scaled_relu};
use crate::description::{Cost, LayerTable};
use crate::resampling::{space_to_depth, upsample_bilinear, upsample_nearest};
use crate::weight_init::WeightInit;
use burn::module::Module;
use burn::tensor::Tensor;
use deepsft_inference::CompactConfig;

/// What the main block hands on. Coordinates are (u, v, d) with d the normalised log depth of
/// [`deepsft_inference::DepthRange`], or (x, y, d, z) of rest positions: C of them. Cells are 8 pixels wide, coarse cells 16. Features are in the precision of the image, bins and
/// coordinates in single precision.
pub struct MainBlockOutput {
    /// Patch features at a quarter of the image, [N, C4, H/4, W/4].
    pub patches: Tensor<4>,
    /// Features, [N, C8, H/8, W/8].
    pub features: Tensor<4>,
    /// Bin logits of each coordinate, [N, K, H/16, W/16].
    pub bins: Vec<Tensor<4>>,
    /// The coordinates, [N, C, H/8, W/8].
    pub coordinates: Tensor<4>,
}

/// Features of an image before anything is read off them; strides 4, 16 and 8.
pub struct Features {
    pub patches: Tensor<4>,
    pub at16: Tensor<4>,
    pub at8: Tensor<4>,
}

/// Encoder to stride 32, decoder back to stride 8 with skip connections, bins at stride 16.
#[derive(Module, Debug)]
pub struct MainBlock {
    patch: Convolution,
    down8: Convolution,
    encode8: ResidualBlock,
    down16: Convolution,
    encode16: ResidualBlock,
    down32: Convolution,
    encode32: Vec<ResidualBlock>,
    lateral16: Convolution,
    decode16: ResidualBlock,
    bins: Vec<Convolution>,
    lateral8: Convolution,
    decode8: ResidualBlock,
    offset: Convolution,
}

impl MainBlock {
    /// Layers of the widths and bins of `config`, randomly initialised.
    pub fn new(config: &CompactConfig, init: WeightInit) -> Self {
        let [c4, c8, c16, c32] = config.channels;
        let conv = |channels, kernel, stride| Convolution::standardised(channels, kernel, stride, 1.0, init);
        Self {
            patch: conv([3 * PATCH * PATCH, c4], 1, 1),
            down8: conv([c4, c8], 3, 2),
            encode8: ResidualBlock::new(c8, init),
            down16: conv([c8, c16], 3, 2),
            encode16: ResidualBlock::new(c16, init),
            down32: conv([c16, c32], 3, 2),
            encode32: (0..config.blocks_at_32)
                .map(|_| ResidualBlock::new(c32, init))
                .collect(),
            lateral16: conv([c32, c16], 1, 1),
            decode16: ResidualBlock::new(c16, init),
            bins: config
                .bins
                .iter()
                .map(|&bins| Convolution::head([c16, bins], 1, init))
                .collect(),
            lateral8: conv([c16, c8], 1, 1),
            decode8: ResidualBlock::new(c8, init),
            offset: Convolution::head([c8, config.bins.len()], 1, init),
        }
    }

    /// Normalised image [N, 3, H, W] with H and W multiples of 16 -> features.
    pub fn features(&self, image: Tensor<4>) -> Features {
        let patches = self.patch.forward(space_to_depth(image, PATCH)); // [N, C4, H/4, W/4]
        let at8 = self.encode8.forward(self.down8.forward_rectified(patches.clone()));
        let at16 = self.encode16.forward(self.down16.forward_rectified(at8.clone()));
        let mut at32 = self.down32.forward_rectified(at16.clone());
        for block in &self.encode32 {
            at32 = block.forward(at32);
        }
        let at16 = at16.clone() + up(&self.lateral16, at32, &at16);
        let at16 = self.decode16.forward(at16);
        let at8 = self
            .decode8
            .forward(at8.clone() + up(&self.lateral8, at16.clone(), &at8));
        Features { patches, at16, at8 }
    }

    /// Normalised image [N, 3, H, W] with H and W multiples of 16 -> [`MainBlockOutput`].
    pub fn forward(&self, image: Tensor<4>) -> MainBlockOutput {
        let Features { patches, at16, at8 } = self.features(image);
        let read = scaled_relu(at16);
        let bins: Vec<Tensor<4>> = self.bins.iter().map(|head| head.forward(read.clone())).collect();
        let coarse = Tensor::cat(
            bins.iter().map(|logits| expected_coordinate(logits.clone())).collect(),
            1,
        );
        let read = scaled_relu(at8.clone());
        let coordinates = upsample_bilinear(coarse, 2) + self.offset.forward(read);
        MainBlockOutput {
            patches,
            features: at8,
            bins,
            coordinates,
        }
    }

    /// Writes its layers into `table`, which holds an image whose sides are multiples of 16.
    pub fn describe(&self, table: &mut LayerTable) {
        let [_, height, width] = table.size;
        let mut add = |name: &str, stride: usize, channels: usize, cost: &dyn Fn(usize) -> Cost| {
            let (rows, columns) = (height.div_ceil(stride), width.div_ceil(stride));
            table.add(name, [channels, rows, columns], cost(rows * columns));
        };
        let [c4, c8, c16, c32] = [&self.patch, &self.down8, &self.down16, &self.down32].map(Convolution::channels);
        add("4x4 patches", 4, c4, &|n| self.patch.cost(n, 1));
        add("down 3x3 stride 2", 8, c8, &|n| self.down8.cost(n, 1));
        add("enc8 residual block", 8, c8, &|n| self.encode8.cost(n));
        add("down 3x3 stride 2", 16, c16, &|n| self.down16.cost(n, 1));
        add("enc16 residual block", 16, c16, &|n| self.encode16.cost(n));
        add("down 3x3 stride 2", 32, c32, &|n| self.down32.cost(n, 1));
        let blocks = format!("enc32 {} residual blocks", self.encode32.len());
        add(&blocks, 32, c32, &|n| {
            self.encode32.iter().map(|block| block.cost(n)).sum()
        });
        add("lateral 1x1", 32, c16, &|n| self.lateral16.cost(n, 1));
        add("dec16 residual block", 16, c16, &|n| self.decode16.cost(n));
        let bins = self.bins.iter().map(Convolution::channels).sum();
        add("bins of coordinates 1x1", 16, bins, &|n| {
            self.bins.iter().map(|head| head.cost(n, 1)).sum()
        });
        add("lateral 1x1", 16, c8, &|n| self.lateral8.cost(n, 1));
        add("dec8 residual block", 8, c8, &|n| self.decode8.cost(n));
        add("offsets 1x1", 8, self.offset.channels(), &|n| self.offset.cost(n, 1));
    }
}

/// A lateral connection: 1x1 at the coarse stride (it commutes with nearest up-sampling), then
/// up-sampled by two and cropped to the size of `like`.
fn up(lateral: &Convolution, coarse: Tensor<4>, like: &Tensor<4>) -> Tensor<4> {
    let [n, c, height, width] = like.dims();
    let doubled = upsample_nearest(lateral.forward_rectified(coarse), 2);
    if doubled.dims() == like.dims() {
        return doubled;
    }
    doubled.slice([0..n, 0..c, 0..height, 0..width])
}
