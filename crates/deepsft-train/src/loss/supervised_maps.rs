//! The loss of training step 1 as the paper has it (equation L1): full-resolution maps against the labels.

use burn::tensor::Tensor;
use deepsft::NetworkMaps;

/// The loss and its parts, each [1].
#[derive(Clone, Debug)]
pub struct SupervisedLosses {
    /// What is minimised.
    pub total: Tensor<1>,
    /// Squared error of the refined registration, with its 1/2.
    pub registration: Tensor<1>,
    /// Squared error of the refined depth.
    pub depth: Tensor<1>,
    /// Squared error of the main block's registration, with its 1/2.
    pub main_registration: Tensor<1>,
    /// Squared error of the main block's depth.
    pub main_depth: Tensor<1>,
}

/// 1/2 ||eta^ - eta||_F^2 + ||rho^ - rho||_F^2 + 1/2 ||eta~ - eta||_F^2 + ||rho~ - rho||_F^2, with ^ the refined maps and ~
/// the main block's, over all pixels of all images, those outside the object included: there the labels say
/// [`deepsft::OUTSIDE`].
///
/// `depth` [N, 1, H, W] is normalised depth, `registration` [N, 2, H, W] in the unit square. The sums are divided by the
/// number of pixels N H W (our choice; Adam, which the paper trains with, hardly sees a factor). A network without
/// refinement counts its one output twice, which is a factor, too.
pub fn supervised_maps_loss(maps: &NetworkMaps, depth: &Tensor<4>, registration: &Tensor<4>) -> SupervisedLosses {
    let [n, _, h, w] = depth.dims();
    let squared = |predicted: &Tensor<4>, label: &Tensor<4>| {
        (predicted.clone() - label.clone()).square().sum() / (n * h * w) as f64
    };
    let registration_error = squared(&maps.registration, registration) * 0.5;
    let depth_error = squared(&maps.depth, depth);
    let main_registration = squared(&maps.main_registration, registration) * 0.5;
    let main_depth = squared(&maps.main_depth, depth);
    SupervisedLosses {
        total: registration_error.clone() + depth_error.clone() + main_registration.clone() + main_depth.clone(),
        registration: registration_error,
        depth: depth_error,
        main_registration,
        main_depth,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use burn::tensor::Device;

    #[test]
    fn the_terms_by_hand() {
        let device = Device::flex();
        let map = |values: &[f32], channels: usize| -> Tensor<4> {
            Tensor::<1>::from_floats(values, &device).reshape([1, channels, 1, 2])
        };
        let maps = NetworkMaps {
            main_depth: map(&[0.5, -1.0], 1),
            main_registration: map(&[0.25, 0.0, 0.75, -1.0], 2),
            depth: map(&[0.25, -1.0], 1),
            registration: map(&[0.0, -1.0, 0.5, -1.0], 2),
            mask_logits: map(&[0.0, 0.0], 1),
        };
        // The object in the first pixel, nothing in the second.
        let losses = supervised_maps_loss(&maps, &map(&[0.0, -1.0], 1), &map(&[0.0, -1.0, 0.25, -1.0], 2));
        let value = |loss: &Tensor<1>| loss.clone().into_scalar::<f32>();
        // Two pixels; registration errors (0, 0.25) and (0.25, 0.5; 1, 0).
        assert_eq!(value(&losses.depth), 0.0625 / 2.0);
        assert_eq!(value(&losses.main_depth), 0.25 / 2.0);
        assert_eq!(value(&losses.registration), 0.5 * 0.0625 / 2.0);
        assert_eq!(value(&losses.main_registration), 0.5 * (0.0625 + 0.25 + 1.0) / 2.0);
        assert_eq!(value(&losses.total), 0.03125 + 0.125 + 0.015625 + 0.328125);
    }
}
