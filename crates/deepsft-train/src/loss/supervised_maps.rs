//! The loss of training step 1 as the paper has it (equation L1): full-resolution maps against the labels.

use burn::tensor::Tensor;
use deepsft_network::NetworkMaps;

/// The loss, [1]: 1/2 ||eta^ - eta||_F^2 + ||rho^ - rho||_F^2 + 1/2 ||eta~ - eta||_F^2 + ||rho~ - rho||_F^2, with ^ the refined maps and ~
/// the main block's, over all pixels of all images, those outside the object included: there the labels say
/// [`deepsft_network::OUTSIDE`].
///
/// `depth` [N, 1, H, W] is normalised depth, `registration` [N, 2, H, W] in the unit square. The sums are divided by the
/// number of pixels N H W (our choice; Adam, which the paper trains with, hardly sees a factor). A network without
/// refinement counts its one output twice, which is a factor, too.
pub fn supervised_maps_loss(maps: &NetworkMaps, depth: &Tensor<4>, registration: &Tensor<4>) -> Tensor<1> {
    let [n, _, h, w] = depth.dims();
    let squared = |predicted: &Tensor<4>, label: &Tensor<4>| {
        (predicted.clone() - label.clone()).square().sum() / (n * h * w) as f64
    };
    let refined = squared(&maps.registration, registration) * 0.5 + squared(&maps.depth, depth);
    refined + squared(&maps.main_registration, registration) * 0.5 + squared(&maps.main_depth, depth)
}
