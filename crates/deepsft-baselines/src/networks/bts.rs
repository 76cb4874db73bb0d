//! BTS: depth from one image by local planar guidance.
//!
//! J. H. Lee, M.-K. Han, D. W. Ko, I. H. Suh, *From Big to Small: Multi-Scale Local Planar Guidance for Monocular Depth Estimation*,
//! arXiv:1907.10326, 2019.
//!
//! # Equations
//!
//! DenseNet-161, two steps of up-sampling with skip connections, dense atrous pooling (rates 3, 6, 12, 18, 24). Then at 1/8, 1/4 and 1/2
//! of the size a plane for each cell: a normal of the polar angle theta = pi/3 s_1 and azimuth phi = 2 pi s_2, a distance
//! n_4 = s_3 times the greatest depth, s by a sigmoid. A pixel at (u, v) of its cell has the depth
//!
//! ```text
//! n_4 / (n_1 u + n_2 v + n_3)
//! ```
//!
//! These three maps guide the last convolution. With d = log y - log y* over the pixels of the mask the loss is
//! 10 sqrt(mean d^2 - 0.85 (mean d)^2).
//!
//! # Where we had to decide
//!
//! * Layers are those of the authors' code for PyTorch (DenseNet-161, 512 features), as we know it.
//! * The greatest depth is 2 m in place of 10; ours end at 1.2 m.
//! * The encoder begins from nothing, where theirs begins from ImageNet; images are not turned, cut or recoloured.
//! * Nothing says where the object is: pixels of the true mask count, as DeepSfT measures.

use super::batch::Batch;
use super::dense_net::DenseNet;
use super::layers::{dilated, narrowed, normalisation, repeated, thinned, unbiased};
use burn::module::Module;
use burn::nn::BatchNorm;
use burn::nn::conv::Conv2d;
use burn::tensor::activation::{elu, relu, sigmoid};
use burn::tensor::{Device, Tensor};
use std::f64::consts::PI;

/// Greatest depth, m.
const GREATEST_M: f64 = 2.0;

/// Features of the decoder.
const FEATURES: usize = 512;

/// Dilations of the atrous pooling.
const RATES: [usize; 5] = [3, 6, 12, 18, 24];

/// Weight of the mean in the loss.
const FOCUS: f64 = 0.85;

/// A convolution without bias, and ELU.
#[derive(Module, Debug)]
struct Elu {
    convolution: Conv2d,
}

impl Elu {
    fn new(channels: [usize; 2], kernel: usize, device: &Device) -> Self {
        let convolution = unbiased(channels, kernel, device);
        Self { convolution }
    }

    fn forward(&self, x: Tensor<4>) -> Tensor<4> {
        elu(self.convolution.forward(x), 1.0)
    }
}

/// Up-sampling by two beside skipped maps.
#[derive(Module, Debug)]
struct Up {
    convolution: Elu,
    normalisation: Option<BatchNorm>,
    mixed: Elu,
}

impl Up {
    fn new(inputs: usize, outputs: usize, skipped: usize, normalised: bool, device: &Device) -> Self {
        Self {
            convolution: Elu::new([inputs, outputs], 3, device),
            normalisation: normalised.then(|| normalisation(outputs, device)),
            mixed: Elu::new([outputs + skipped, outputs], 3, device),
        }
    }

    fn larger(&self, x: Tensor<4>) -> Tensor<4> {
        let x = self.convolution.forward(repeated(x, 2));
        self.normalisation.iter().fold(x, |x, layer| layer.forward(x))
    }
}

#[derive(Module, Debug)]
struct Atrous {
    before: Option<BatchNorm>,
    narrow: Conv2d,
    normalisation: BatchNorm,
    convolution: Conv2d,
}

impl Atrous {
    fn new(inputs: usize, outputs: usize, rate: usize, device: &Device) -> Self {
        Self {
            before: (rate != RATES[0]).then(|| normalisation(inputs, device)),
            narrow: unbiased([inputs, 2 * outputs], 1, device),
            normalisation: normalisation(2 * outputs, device),
            convolution: dilated([2 * outputs, outputs], rate).with_bias(false).init(device),
        }
    }

    fn forward(&self, x: Tensor<4>) -> Tensor<4> {
        let x = self.before.iter().fold(x, |x, layer| layer.forward(x));
        let x = self.normalisation.forward(self.narrow.forward(relu(x)));
        self.convolution.forward(relu(x))
    }
}

/// 1 x 1 convolutions that halve channels until they say the three numbers of a plane, or one.
#[derive(Module, Debug)]
struct Reduction {
    halving: Vec<Elu>,
    last: Conv2d,
}

impl Reduction {
    fn new(mut inputs: usize, mut outputs: usize, says: usize, device: &Device) -> Self {
        let mut halving = Vec::new();
        while outputs >= 8 {
            halving.push(Elu::new([inputs, outputs], 1, device));
            (inputs, outputs) = (outputs, outputs / 2);
        }
        let last = unbiased([inputs, says], 1, device);
        Self { halving, last }
    }

    fn forward(&self, x: Tensor<4>) -> Tensor<4> {
        let halved = self.halving.iter().fold(x, |x, layer| layer.forward(x));
        sigmoid(self.last.forward(halved))
    }
}

/// The depth, a share of the greatest, that planes of cells say of their `factor` x `factor` pixels: [N, 3, h, w] -> [N, 1, factor h, factor w].
fn planar_guidance(planes: Tensor<4>, factor: usize) -> Tensor<4> {
    let [n, _, h, w] = planes.dims();
    let device = planes.device();
    let part = |k: usize| repeated(planes.clone().slice([0..n, k..k + 1, 0..h, 0..w]), factor);
    let (theta, phi) = (part(0) * (PI / 3.0), part(1) * (2.0 * PI));
    let within = |length: usize, across: bool| {
        let of = |k: usize| ((k % factor) as f32 - (factor as f32 - 1.0) / 2.0) / factor as f32;
        let values: Vec<f32> = (0..length).map(of).collect();
        let shape = if across { [1, 1, 1, length] } else { [1, 1, length, 1] };
        Tensor::<1>::from_floats(values.as_slice(), &device).reshape(shape)
    };
    let sine = theta.clone().sin();
    let along =
        sine.clone() * phi.clone().cos() * within(factor * w, true) + sine * phi.sin() * within(factor * h, false);
    part(2) / (along + theta.cos())
}

/// The network with its weights.
#[derive(Module, Debug)]
pub struct Bts {
    encoder: DenseNet,
    up5: Up,
    up4: Up,
    normalisation4: BatchNorm,
    atrous: Vec<Atrous>,
    pooled: Elu,
    planes: Vec<Reduction>,
    up3: Up,
    up2: Up,
    up1: Up,
    single: Reduction,
    output: Conv2d,
}

impl Bts {
    /// New weights of `1 / divisor` of the widths of the authors' code.
    pub fn new(divisor: usize, device: &Device) -> Self {
        let (encoder, [half, quarter, eighth, sixteenth, end]) =
            DenseNet::new(48, 96, [6, 12, 36, 24], divisor, device);
        let f = |part: usize| narrowed(FEATURES / part, divisor);
        // What each rate sees: maps of 1/8 of the size, and the rates before.
        let atrous = RATES.iter().enumerate().map(|(k, &rate)| {
            let inputs = if k == 0 { f(2) } else { f(2) + eighth + k * f(4) };
            Atrous::new(inputs, f(4), rate, device)
        });
        let planes = |(inputs, outputs)| Reduction::new(f(inputs), f(outputs), 3, device);
        Self {
            up5: Up::new(end, f(1), sixteenth, true, device),
            up4: Up::new(f(1), f(2), eighth, true, device),
            normalisation4: normalisation(f(2), device),
            atrous: atrous.collect(),
            pooled: Elu::new([f(2) + RATES.len() * f(4), f(4)], 3, device),
            planes: [(4, 4), (4, 8), (8, 16)].map(planes).into(),
            up3: Up::new(f(4), f(4), quarter + 1, true, device),
            up2: Up::new(f(4), f(8), half + 1, true, device),
            up1: Up::new(f(8), f(16), 4, false, device),
            single: Reduction::new(f(16), f(32), 1, device),
            output: unbiased([f(16), 1], 3, device),
            encoder,
        }
    }

    /// Depth, m: [N, 3, H, W] -> [N, 1, H, W].
    pub fn depth(&self, images: Tensor<4>) -> Tensor<4> {
        let [half, quarter, eighth, sixteenth, end] = self.encoder.forward(images);
        let cat = |maps: Vec<Tensor<4>>| Tensor::cat(maps, 1);
        let x = self.up5.mixed.forward(cat(vec![self.up5.larger(end), sixteenth]));
        let mut seen = cat(vec![self.up4.larger(x), eighth]);
        let x = self.normalisation4.forward(self.up4.mixed.forward(seen.clone()));
        let mut pooled = vec![x.clone()];
        for (k, atrous) in self.atrous.iter().enumerate() {
            let said = atrous.forward(if k == 0 { x.clone() } else { seen.clone() });
            seen = cat(vec![seen, said.clone()]);
            pooled.push(said);
        }
        let x = self.pooled.forward(cat(pooled));
        let guided8 = planar_guidance(self.planes[0].forward(x.clone()), 8);
        let x = cat(vec![self.up3.larger(x), quarter, thinned(guided8.clone(), 4)]);
        let x = self.up3.mixed.forward(x);
        let guided4 = planar_guidance(self.planes[1].forward(x.clone()), 4);
        let x = cat(vec![self.up2.larger(x), half, thinned(guided4.clone(), 2)]);
        let x = self.up2.mixed.forward(x);
        let guided2 = planar_guidance(self.planes[2].forward(x.clone()), 2);
        let x = self.up1.larger(x);
        let single = self.single.forward(x.clone());
        let x = self.up1.mixed.forward(cat(vec![x, single, guided2, guided4, guided8]));
        sigmoid(self.output.forward(x)) * GREATEST_M
    }

    /// What training minimises.
    pub fn loss(&self, batch: &Batch) -> Tensor<1> {
        let count = batch.mask.clone().sum().clamp_min(1.0);
        let said = self.depth(batch.images.clone()).clamp_min(1e-3).log();
        let difference = (said - batch.depth.clone().log()) * batch.mask.clone();
        let mean = difference.clone().sum() / count.clone();
        let square = difference.square().sum() / count;
        ((square - mean.square() * FOCUS).clamp_min(1e-12)).sqrt() * 10.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_slanted_plane_is_said_by_its_cells_without_error() {
        // The plane depth = 0.3 / (0.4 u + 0.2 v + c) of one cell with its polar angle and azimuth.
        let device = Device::flex();
        let (theta, phi) = (0.5_f64, 0.7_f64);
        let shares = [theta / (PI / 3.0), phi / (2.0 * PI), 0.3].map(|share| share as f32);
        let planes = Tensor::<1>::from_floats(shares, &device).reshape([1, 3, 1, 1]);
        let depth: Vec<f32> = planar_guidance(planes, 4).into_data().try_to_vec().unwrap();
        for (k, depth) in depth.iter().enumerate() {
            let (u, v) = ((k % 4) as f64 / 4.0 - 0.375, (k / 4) as f64 / 4.0 - 0.375);
            let along = theta.sin() * (phi.cos() * u + phi.sin() * v);
            assert!((f64::from(*depth) - 0.3 / (along + theta.cos())).abs() < 1e-6, "{k}");
        }
    }
}
