//! IsMo-GAN: the grid of a sheet's points from one image, learnt against a network that tells grids apart.
//!
//! S. Shimada, V. Golyanik, C. Theobalt, D. Stricker, *IsMo-GAN: Adversarial Learning for Monocular Non-Rigid 3D Reconstruction*, CVPR Workshops
//! 2019, arXiv:1904.12144.
//!
//! # Equations
//!
//! A detection network (OD-Net, a U-Net) says where the object is, learnt by the cross entropy of the mask. The reconstruction network sees the image
//! where that is, and says the points S. The discriminator D tells said grids from true ones:
//!
//! ```text
//! L_D = -log D(S*) - log(1 - D(S)),   L = mean |S - S*|^2 + w mean |S - S~|^2 - a log D(S)
//! ```
//!
//! # Where we had to decide
//!
//! * The reconstruction network is that of [`super::hdm_net`], of the same authors, with its sizes, decisions and first two terms.
//! * OD-Net says its mask at half the image's size. It learns beside the others, which see its mask as given; the authors train it before, and keep
//!   the largest contour.
//! * D sees grids without their mean, so that it judges shapes. Both sides take a step on each batch. a is our choice.

use super::batch::Batch;
use super::hdm_net::HdmNet;
use super::layers::{Normalised, convolution, narrowed, repeated, thinned};
use burn::module::Module;
use burn::nn::conv::Conv2d;
use burn::tensor::activation::{leaky_relu, log_sigmoid, sigmoid};
use burn::tensor::{Device, Tensor};

/// Channels of the detection network's levels, at 1/2 to 1/16 of the image's size, and of the discriminator's.
const LEVELS: [usize; 4] = [32, 64, 128, 256];
const JUDGING: [usize; 4] = [64, 128, 256, 512];

/// Weight of the adversarial term, beside squared metres.
const ADVERSARIAL: f64 = 1e-5;

#[derive(Module, Debug)]
struct Detection {
    down: Vec<Normalised>,
    up: Vec<Normalised>,
    output: Conv2d,
}

impl Detection {
    /// The logit of the mask at half the size.
    fn forward(&self, images: Tensor<4>) -> Tensor<4> {
        let mut levels = Vec::new();
        let mut x = images;
        for down in &self.down {
            x = down.forward(x);
            levels.push(x.clone());
        }
        levels.pop();
        for up in &self.up {
            let beside = levels.pop().into_iter();
            x = up.forward(Tensor::cat(std::iter::once(repeated(x, 2)).chain(beside).collect(), 1));
        }
        self.output.forward(x)
    }
}

/// Convolutions of stride 2 with leaky ReLU, and one that says the logit of "true", averaged.
#[derive(Module, Debug)]
struct Discriminator {
    layers: Vec<Conv2d>,
    output: Conv2d,
}

impl Discriminator {
    fn forward(&self, points: Tensor<4>) -> Tensor<4> {
        let centred = points.clone() - points.mean_dims(&[2, 3]);
        let step = |x: Tensor<4>, layer: &Conv2d| leaky_relu(layer.forward(x), 0.2);
        let x = self.layers.iter().fold(centred * 10.0, step);
        self.output.forward(x).mean_dims(&[2, 3])
    }
}

/// The network with its weights.
#[derive(Module, Debug)]
pub struct IsMoGan {
    detection: Detection,
    reconstruction: HdmNet,
    discriminator: Discriminator,
}

impl IsMoGan {
    /// New weights of `1 / divisor` of the widths, for a grid of (columns, rows) vertices.
    pub fn new(grid: (usize, usize), divisor: usize, device: &Device) -> Self {
        let [levels, judging] = [LEVELS, JUDGING].map(|widths| widths.map(|width| narrowed(width, divisor)));
        let halved = |widths: [usize; 4]| {
            let channels = std::iter::once(3).chain(widths).zip(widths);
            channels.map(|(inputs, outputs)| convolution([inputs, outputs], 3).with_stride([2, 2]))
        };
        let up = |k: usize| Normalised::new(convolution([levels[k + 1] + levels[k], levels[k]], 3), device);
        Self {
            detection: Detection {
                down: halved(levels).map(|layer| Normalised::new(layer, device)).collect(),
                up: (0..3).rev().map(up).collect(),
                output: convolution([levels[0], 1], 1).init(device),
            },
            reconstruction: HdmNet::new(3, grid, divisor, device),
            discriminator: Discriminator {
                layers: halved(judging).map(|layer| layer.init(device)).collect(),
                output: convolution([judging[3], 1], 1).init(device),
            },
        }
    }

    fn masked(images: Tensor<4>, logit: Tensor<4>) -> Tensor<4> {
        images * repeated(sigmoid(logit.detach()), 2)
    }

    /// The points, m, camera frame: [N, 3, H, W] -> [N, 3, rows, columns].
    pub fn points(&self, images: Tensor<4>) -> Tensor<4> {
        let logit = self.detection.forward(images.clone());
        self.reconstruction.points(Self::masked(images, logit))
    }

    /// What training minimises: of all three networks, each by its own terms.
    pub fn loss(&self, batch: &Batch) -> Tensor<1> {
        let logit = self.detection.forward(batch.images.clone());
        let mask = thinned(batch.mask.clone(), 2);
        let outside = mask.clone().neg() + 1.0;
        let detection = mask * log_sigmoid(logit.clone()) + outside * log_sigmoid(logit.clone().neg());
        let said = self.reconstruction.points(Self::masked(batch.images.clone(), logit));
        // The judge of the generator's term does not learn from it.
        let deceived = log_sigmoid(self.discriminator.clone().no_grad().forward(said.clone()));
        let is_true = log_sigmoid(self.discriminator.forward(batch.points.clone()));
        let is_said = log_sigmoid(self.discriminator.forward(said.clone().detach()).neg());
        let adversarial = deceived.mean() * ADVERSARIAL + is_true.mean() + is_said.mean();
        HdmNet::points_loss(said, batch) - detection.mean() - adversarial
    }
}
