//! The squared total variation by hand.

use crate::loss::squared_total_variation;
use burn::tensor::Device;
use burn::tensor::Tensor;

#[test]
fn differences_inside_are_summed_and_squared_image_by_image() {
    let device = Device::flex();
    let maps = Tensor::<1>::from_floats([1.0, 3.0, 2.0, 7.0, 0.0, 1.0, 1.0, 1.0], &device).reshape([2, 1, 2, 2]);
    let all = Tensor::ones([2, 1, 2, 2], &device);
    // First image: 2 + 5 across, 1 + 4 down: 12. Second: 1 + 0 across, 1 + 0 down: 2.
    let value = squared_total_variation(maps.clone(), all).into_scalar::<f32>();
    assert_eq!(value, 144.0 + 4.0);
    // Without the last pixel of the first image: 2 across, 1 down; without the first of the second: nothing is left
    // but 0 across and 0 down.
    let inside = Tensor::<1>::from_floats([1.0, 1.0, 1.0, 0.0, 0.0, 1.0, 1.0, 1.0], &device).reshape([2, 1, 2, 2]);
    assert_eq!(squared_total_variation(maps, inside).into_scalar::<f32>(), 9.0);
}
