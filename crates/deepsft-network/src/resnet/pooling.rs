//! Max pooling, cropping.

use burn::tensor::{Tensor, module::max_pool2d, ops::MaxPoolOptions};

/// Largest value of each 3 x 3 window, one window every `stride` pixels:
/// [N, C, H, W] -> [N, C, floor((H + 2 padding - 3) / stride) + 1, ...]; what is padded never wins.
pub fn max_pool(x: Tensor<4>, stride: usize, padding: usize) -> Tensor<4> {
    let options = MaxPoolOptions::new([3, 3])
        .with_stride([stride, stride])
        .with_padding([padding, padding]);
    max_pool2d(x, options)
}

/// `height` rows from row `top`: [N, C, H, W] -> [N, C, height, W].
pub fn crop_rows(x: Tensor<4>, top: usize, height: usize) -> Tensor<4> {
    let [n, c, rows, w] = x.dims();
    if rows == height {
        return x;
    }
    x.slice([0..n, 0..c, top..top + height, 0..w])
}

#[cfg(test)]
mod tests {
    use super::*;
    use burn::tensor::Device;

    fn ramp(shape: [usize; 4]) -> Tensor<4> {
        let count: usize = shape.iter().product();
        let values: Vec<f32> = (0..count).map(|i| i as f32).collect();
        Tensor::<1>::from_floats(values.as_slice(), &Device::flex()).reshape(shape)
    }

    fn values(x: Tensor<4>) -> Vec<f32> {
        x.into_data().try_to_vec().unwrap()
    }

    #[test]
    fn windows_of_three_by_three_side_by_side_and_overlapping() {
        // Rows 0..5, 6..11, 12..17: the last row of each window is the largest.
        assert_eq!(values(max_pool(ramp([1, 1, 3, 6]), 3, 0)), [14.0, 17.0]);
        // Windows around columns 0, 2, 4 and rows 0, 2, all negative: padding must not win.
        let pooled = max_pool(ramp([1, 1, 3, 6]) - 100.0, 2, 1);
        assert_eq!(values(pooled), [-93.0, -91.0, -89.0, -87.0, -85.0, -83.0]);
    }

    #[test]
    fn rows_are_cut_off() {
        assert_eq!(values(crop_rows(ramp([1, 1, 4, 2]), 1, 2)), [2.0, 3.0, 4.0, 5.0]);
    }
}
