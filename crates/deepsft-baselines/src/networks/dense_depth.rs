//! DenseDepth: depth from one image by an encoder and a decoder with skip connections.
//!
//! I. Alhashim, P. Wonka, *High Quality Monocular Depth Estimation via Transfer Learning*, arXiv:1812.11941, 2018.
//!
//! # Equations
//!
//! DenseNet-169, a 1 x 1 convolution, then four times: bilinear up-sampling by two, the encoder's maps of that size beside it, two 3 x 3
//! convolutions with leaky ReLU (0.2). It says y = 1 / depth at half the image's size. With g the gradient of maps:
//!
//! ```text
//! 0.1 mean |y - y*| + mean |g(y) - g(y*)| + mean (1 - SSIM(y, y*)) / 2
//! ```
//!
//! # Where we had to decide
//!
//! * The decoder is the article's, and not that of the authors' code of later days, of half the width.
//! * Depth is in metres, so that y is of the order of 2; theirs is 10 m over depth.
//! * Maps count inside the true mask alone, as DeepSfT measures: outside both are 0. Nothing says where the object is.
//! * SSIM is of boxes of 7 pixels, where TensorFlow has a Gaussian of 11.
//! * The encoder begins from nothing, where theirs begins from ImageNet; no mirrored images or swapped colours.

use super::batch::Batch;
use super::dense_net::DenseNet;
use super::layers::{convolution, resized, thinned};
use burn::module::Module;
use burn::nn::conv::Conv2d;
use burn::tensor::activation::leaky_relu;
use burn::tensor::module::avg_pool2d;
use burn::tensor::ops::AvgPoolOptions;
use burn::tensor::{Device, Tensor};

/// Slope of the leaky ReLU, and the weight of the pointwise difference.
const SLOPE: f64 = 0.2;
const POINTWISE: f64 = 0.1;

/// Side of the boxes of SSIM, and its constants for values up to 4 (of 0.25 m).
const BOX: usize = 7;
const C1: f64 = 0.04 * 0.04;
const C2: f64 = 0.12 * 0.12;

/// Least inverse depth that is said, 1/m.
const LEAST: f64 = 0.1;

#[derive(Module, Debug)]
struct UpProjection {
    first: Conv2d,
    second: Conv2d,
}

impl UpProjection {
    fn forward(&self, x: Tensor<4>, skipped: Tensor<4>) -> Tensor<4> {
        let [.., h, w] = skipped.dims();
        let x = Tensor::cat(vec![resized(x, [h, w]), skipped], 1);
        let x = leaky_relu(self.first.forward(x), SLOPE);
        leaky_relu(self.second.forward(x), SLOPE)
    }
}

/// The network with its weights.
#[derive(Module, Debug)]
pub struct DenseDepth {
    encoder: DenseNet,
    entry: Conv2d,
    up: Vec<UpProjection>,
    output: Conv2d,
}

impl DenseDepth {
    /// New weights of `1 / divisor` of the article's widths.
    pub fn new(divisor: usize, device: &Device) -> Self {
        let (encoder, [half, quarter, eighth, sixteenth, end]) =
            DenseNet::new(32, 64, [6, 12, 32, 32], divisor, device);
        let mut channels = end;
        let up = [sixteenth, eighth, quarter, half].map(|skipped| {
            let (inputs, outputs) = (channels + skipped, channels / 2);
            channels = outputs;
            UpProjection {
                first: convolution([inputs, outputs], 3).init(device),
                second: convolution([outputs, outputs], 3).init(device),
            }
        });
        Self {
            encoder,
            entry: convolution([end, end], 1).init(device),
            up: up.into(),
            output: convolution([channels, 1], 3).init(device),
        }
    }

    /// Inverse depth, 1/m, of half the size.
    fn inverse_depth(&self, images: Tensor<4>) -> Tensor<4> {
        let [half, quarter, eighth, sixteenth, end] = self.encoder.forward(images);
        let skips = [sixteenth, eighth, quarter, half];
        let up = self.up.iter().zip(skips);
        self.output
            .forward(up.fold(self.entry.forward(end), |x, (up, skipped)| up.forward(x, skipped)))
    }

    /// Depth, m: [N, 3, H, W] -> [N, 1, H, W].
    pub fn depth(&self, images: Tensor<4>) -> Tensor<4> {
        let [.., h, w] = images.dims();
        resized(self.inverse_depth(images), [h, w]).clamp_min(LEAST).recip()
    }

    /// What training minimises.
    pub fn loss(&self, batch: &Batch) -> Tensor<1> {
        let mask = thinned(batch.mask.clone(), 2);
        let truth = thinned(batch.depth.clone(), 2).recip() * mask.clone();
        let said = self.inverse_depth(batch.images.clone()) * mask.clone();
        // Means over the mask: the share of it is divided out.
        let share = mask.mean().clamp_min(1e-3);
        let difference = said.clone() - truth.clone();
        let [n, c, h, w] = difference.dims();
        let gradient = |from: [usize; 2]| {
            let moved = difference.clone().slice([0..n, 0..c, from[0]..h, from[1]..w]);
            let kept = difference.clone().slice([0..n, 0..c, 0..h - from[0], 0..w - from[1]]);
            (moved - kept).abs().mean()
        };
        let unlike = (similarity(said, truth).neg() + 1.0).mean() / 2.0;
        (difference.clone().abs().mean() * POINTWISE + gradient([0, 1]) + gradient([1, 0]) + unlike) / share
    }
}

/// SSIM of boxes.
fn similarity(x: Tensor<4>, y: Tensor<4>) -> Tensor<4> {
    let mean = |maps: Tensor<4>| avg_pool2d(maps, AvgPoolOptions::new([BOX, BOX]).with_stride([1, 1]));
    let (mx, my) = (mean(x.clone()), mean(y.clone()));
    let (mxx, myy, mxy) = (mx.clone().square(), my.clone().square(), mx * my);
    let variances = mean(x.clone().square()) - mxx.clone() + mean(y.clone().square()) - myy.clone();
    let covariance = mean(x * y) - mxy.clone();
    let like = (mxy * 2.0 + C1) * (covariance * 2.0 + C2);
    like / ((mxx + myy + C1) * (variances + C2))
}
