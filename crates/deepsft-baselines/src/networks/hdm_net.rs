//! HDM-Net: the grid of a sheet's points from one image.
//!
//! V. Golyanik, S. Shimada, K. Varanasi, D. Stricker, *HDM-Net: Monocular Non-Rigid 3D Reconstruction with Learned Deformation Model*,
//! EuroVR 2018, arXiv:1803.10193.
//!
//! # Equations
//!
//! A convolutional encoder with identity shortcuts takes 224 x 224 pixels to 28 x 28 x 128, a decoder of transposed convolutions that to 73 x 73 x 3,
//! the points S. With S~ the grid smoothed by a Gaussian, the loss is
//!
//! ```text
//! mean |S - S*|^2 + w mean |S - S~|^2
//! ```
//!
//! # Where we had to decide
//!
//! * Images are 480 x 270, the grid that of the template: DeepSfT adapted both sizes too. The code is this: 1/8 of the image's size and 128 channels.
//! * The article's sheet fills the image, ours lies anywhere: shortcuts bridge convolutions of growing dilation, so that every cell sees the
//!   whole image, and the decoder is told each cell's place on the sheet. Layers between the three sizes are our choice; we know of no printed parameter count.
//! * The contour loss is left out. It draws silhouettes as gradients, and our sheets leave the image and lie behind hands.
//! * Points are the camera's, in metres; the network says their difference from a point straight ahead. w is our choice.
//!
//! The limits are the method's: regular grids only, one camera, no registration of its own. Its mesh is drawn as the camera would see it.

use super::batch::Batch;
use super::layers::{Normalised, convolution, dilated, narrowed, normalisation};
use burn::module::Module;
use burn::nn::BatchNorm;
use burn::nn::conv::{Conv2d, ConvTranspose2d, ConvTranspose2dConfig};
use burn::tensor::module::{adaptive_avg_pool2d, conv2d};
use burn::tensor::ops::ConvOptions;
use burn::tensor::{Device, Tensor, activation::relu};

/// Channels at the full width: of the entry, and of the code.
const ENTRY: usize = 64;
const CODE: usize = 128;

/// Dilations of the shortcuts' convolutions.
const DILATIONS: [usize; 5] = [1, 2, 4, 8, 16];

/// Times by which the decoder's two transposed convolutions enlarge.
const ENLARGED: usize = 4;

/// Weight of the smoothness.
const SMOOTH: f64 = 0.1;

/// The point that all differences are from, m.
const AHEAD_M: [f32; 3] = [0.0, 0.0, 0.5];

/// Gaussian of variance 1 on 3 x 3 cells.
const GAUSSIAN: [f32; 9] = [
    0.075_11, 0.123_84, 0.075_11, 0.123_84, 0.204_2, 0.123_84, 0.075_11, 0.123_84, 0.075_11,
];

#[derive(Module, Debug)]
struct Shortcut {
    first: Normalised,
    second: Normalised,
}

#[derive(Module, Debug)]
struct Larger {
    convolution: ConvTranspose2d,
    normalisation: BatchNorm,
}

/// The network with its weights.
#[derive(Module, Debug)]
pub struct HdmNet {
    entry: Vec<Normalised>,
    shortcuts: Vec<Shortcut>,
    larger: Vec<Larger>,
    output: Conv2d,
    grid: [usize; 2],
}

impl HdmNet {
    /// New weights of `1 / divisor` of the widths, for a grid of (columns, rows) vertices and images of so many channels.
    pub fn new(channels: usize, (columns, rows): (usize, usize), divisor: usize, device: &Device) -> Self {
        let (entry, code) = (narrowed(ENTRY, divisor), narrowed(CODE, divisor));
        let halved = |(channels, kernel)| Normalised::new(convolution(channels, kernel).with_stride([2, 2]), device);
        let shortcut = |&dilation: &usize| {
            let layer = || Normalised::new(dilated([code, code], dilation), device);
            Shortcut {
                first: layer(),
                second: layer(),
            }
        };
        let larger = |channels: [usize; 2]| {
            let config = ConvTranspose2dConfig::new(channels, [4, 4]).with_bias(false);
            Larger {
                convolution: config.with_stride([2, 2]).with_padding([1, 1]).init(device),
                normalisation: normalisation(channels[1], device),
            }
        };
        Self {
            entry: [([channels, entry], 7), ([entry, code], 3), ([code, code], 3)]
                .map(halved)
                .into(),
            shortcuts: DILATIONS.iter().map(shortcut).collect(),
            // Beside the code a cell's two coordinates.
            larger: vec![larger([code + 2, code]), larger([code, entry])],
            output: convolution([entry, 3], 3).init(device),
            grid: [rows, columns],
        }
    }

    /// The points, m, camera frame: [N, channels, H, W] -> [N, 3, rows, columns].
    pub fn points(&self, images: Tensor<4>) -> Tensor<4> {
        let x = self.entry.iter().fold(images, |x, layer| layer.forward(x));
        let code = self.shortcuts.iter().fold(x, |x, shortcut| {
            relu(shortcut.second.linear(shortcut.first.forward(x.clone())) + x)
        });
        let [n, ..] = code.dims();
        let device = code.device();
        let [rows, columns] = self.grid;
        let (h, w) = (rows.div_ceil(ENLARGED), columns.div_ceil(ENLARGED));
        let columns_of = (0..h * w).map(|k| (k % w) as f32 / w as f32);
        let rows_of = (0..h * w).map(|k| (k / w) as f32 / h as f32);
        let places: Vec<f32> = columns_of.chain(rows_of).collect();
        let places = Tensor::<1>::from_floats(places.as_slice(), &device).reshape([1, 2, h, w]);
        let x = Tensor::cat(vec![adaptive_avg_pool2d(code, [h, w]), places.expand([n, 2, h, w])], 1);
        let x = self.larger.iter().fold(x, |x, layer| {
            relu(layer.normalisation.forward(layer.convolution.forward(x)))
        });
        let [_, channels, ..] = x.dims();
        let ahead = Tensor::<1>::from_floats(AHEAD_M, &device).reshape([1, 3, 1, 1]);
        self.output.forward(x.slice([0..n, 0..channels, 0..rows, 0..columns])) + ahead
    }

    /// The loss of the points that were said.
    pub fn points_loss(said: Tensor<4>, batch: &Batch) -> Tensor<1> {
        let [n, c, rows, columns] = said.dims();
        let distance = (said.clone() - batch.points.clone()).square().mean();
        let kernel = Tensor::<1>::from_floats(GAUSSIAN, &said.device()).reshape([1, 1, 3, 3]);
        let planes = said.clone().reshape([n * c, 1, rows, columns]);
        let options = ConvOptions::new([1, 1], [0, 0], [1, 1], 1);
        let smooth = conv2d(planes.clone(), kernel, None, options);
        let inner = planes.slice([0..n * c, 0..1, 1..rows - 1, 1..columns - 1]);
        distance + (inner - smooth).square().mean() * SMOOTH
    }

    /// What training minimises.
    pub fn loss(&self, batch: &Batch) -> Tensor<1> {
        Self::points_loss(self.points(batch.images.clone()), batch)
    }
}
