//! Nearest up-sampling.

use burn::tensor::Tensor;

/// Every pixel `factor` x `factor` times: [N, C, h, w] -> [N, C, factor h, factor w].
pub fn upsample_nearest(x: Tensor<4>, factor: usize) -> Tensor<4> {
    if factor == 1 {
        return x;
    }
    let [n, c, h, w] = x.dims();
    // [N, C, h, 1, w, 1] -> [N, C, h, factor, w, factor]
    let spread: Tensor<6> = x.reshape([n, c, h, 1, w, 1]).expand([n, c, h, factor, w, factor]);
    spread.reshape([n, c, factor * h, factor * w])
}

#[cfg(test)]
mod tests {
    use super::*;
    use burn::tensor::Device;

    #[test]
    fn every_pixel_is_repeated_across_and_down() {
        let x = Tensor::<1>::from_floats([0.0, 1.0, 2.0, 3.0], &Device::flex()).reshape([1, 1, 2, 2]);
        let repeated: Vec<f32> = upsample_nearest(x.clone(), 3).into_data().try_to_vec().unwrap();
        let row = |a: f32, b: f32| [a, a, a, b, b, b];
        assert_eq!(repeated, [[row(0.0, 1.0); 3], [row(2.0, 3.0); 3]].concat().concat());
        assert_eq!(upsample_nearest(x.clone(), 1).into_data(), x.into_data());
    }
}
