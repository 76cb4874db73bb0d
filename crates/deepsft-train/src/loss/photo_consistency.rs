//! The loss of training step 3 (paper, equation `photoref`): the image against the template seen through the registration.

use super::bilinear_warp::TexturePyramid;
use super::mean_over;
use super::total_variation::squared_total_variation;
use burn::tensor::Tensor;
use serde::Serialize;

/// Intensity of white: the images' values are 0..=1, the loss's constants are for 0..=255.
const WHITE: f64 = 255.0;

/// What the M-estimator is applied to.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[non_exhaustive]
pub enum Residual {
    /// The squared difference of the intensities, as the paper prints it: chi((I' - I)^2). With c = 4 the estimator bends
    /// at a difference of two grey levels.
    Squared,
    /// The difference itself, as is usual.
    Plain,
}

/// What is done about light before the comparison.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[non_exhaustive]
pub enum Light {
    /// Nothing: as the paper, which leaves it to the M-estimator.
    Ignored,
    /// Nothing in the loss: the texture that it is given is in the colours in which the recording's camera shows it, a gain
    /// and an offset of each colour for the whole recording ([`RecordedFrames::colors`](crate::RecordedFrames::colors)).
    Recorded,
}

/// Photo-consistency at two scales and total variation.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct PhotoConsistencyLoss {
    /// Scale c of the Cauchy estimator chi(x) = c^2 / 2 ln(1 + (x / c)^2), for intensities of 0..=255. The paper: 4.
    pub cauchy_scale: f64,
    /// What the estimator is applied to. The paper: [`Residual::Squared`].
    pub residual: Residual,
    /// Weight mu of the half-size images. The paper: 0.5.
    pub half_size: f64,
    /// Weight lambda of the registration's squared total variation. The paper: 1e-9.
    pub total_variation: f64,
    /// What is done about light. The paper: [`Light::Ignored`].
    pub light: Light,
}

impl PhotoConsistencyLoss {
    /// The loss, [1]: sum chi(I' - I) + mu sum chi(I'_half - I_half) + lambda sum || nabla eta ||_1^2 over the object's pixels and the
    /// three colours, divided by the number of these pixels.
    ///
    /// `registration` [N, 2, H, W]; `images` [N, 3, H, W], 0..=1; `inside` [N, 1, H, W], 0 or 1; `levels`: the level of
    /// the texture for each image.
    pub(crate) fn apply(
        &self,
        registration: Tensor<4>,
        images: &Tensor<4>,
        inside: &Tensor<4>,
        texture: &TexturePyramid,
        levels: &[usize],
    ) -> Tensor<1> {
        let drawn = levels.iter().enumerate().map(|(n, &level)| {
            let one = registration.clone().slice(n..n + 1);
            texture.warp(level, one)
        });
        let drawn = Tensor::cat(drawn.collect(), 0); // [N, 3, H, W]
        let seen = images.clone() * WHITE;
        let whole = self.robust(drawn.clone() - seen.clone(), inside.clone());
        let half = self.robust(halved(drawn) - halved(seen), all_of_four(inside.clone()));
        let smoothness = squared_total_variation(registration, inside.clone()) * self.total_variation;
        mean_over(inside.clone(), whole + half * self.half_size, smoothness)
    }

    /// Sum of chi over colours and the pixels inside, [1].
    fn robust(&self, difference: Tensor<4>, inside: Tensor<4>) -> Tensor<1> {
        let x2 = match self.residual {
            Residual::Squared => difference.square().square(),
            Residual::Plain => difference.square(),
        };
        let c2 = self.cauchy_scale * self.cauchy_scale;
        let chi = ((x2 / c2) + 1.0).log() * (c2 / 2.0);
        (chi * inside).sum()
    }
}

/// Images of half the size, each pixel the mean of four: [N, C, H, W] -> [N, C, H / 2, W / 2]; an odd last row or column
/// is left out.
fn halved(x: Tensor<4>) -> Tensor<4> {
    let [n, c, h, w] = x.dims();
    let (rows, columns) = (h / 2, w / 2);
    let even = x.slice([0..n, 0..c, 0..2 * rows, 0..2 * columns]);
    let fours: Tensor<6> = even.reshape([n, c, rows, 2, columns, 2]);
    let mean: Tensor<6> = fours.mean_dim(3).mean_dim(5);
    mean.reshape([n, c, rows, columns])
}

/// 1 where all four pixels of a mask are 1, 0 elsewhere: [N, 1, H, W] -> [N, 1, H / 2, W / 2].
fn all_of_four(inside: Tensor<4>) -> Tensor<4> {
    (halved(inside) * 4.0 - 3.0).clamp_min(0.0)
}
