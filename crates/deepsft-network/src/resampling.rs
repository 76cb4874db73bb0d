//! Maps of another size: up-sampling, pooling, cropping, patches.

use burn::tensor::{Device, Tensor, module::max_pool2d, ops::MaxPoolOptions, ops::PadMode};

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
    if x.dims()[2] == height {
        return x;
    }
    x.narrow(2, top, height)
}

/// Zeros at the right and below up to multiples of `multiple`: [N, C, H, W] -> [N, C, H', W'].
pub fn padded_to_multiple(images: Tensor<4>, multiple: usize) -> Tensor<4> {
    let [_, _, height, width] = images.dims();
    let [below, right] = [height, width].map(|side| side.next_multiple_of(multiple) - side);
    images.pad((0, right, 0, below), PadMode::Constant(0.0))
}

/// Bilinear up-sampling by an integer factor, cells' centres kept, edges repeated:
/// [N, C, h, w] -> [N, C, factor h, factor w]. Two matrix products, the same on every device.
pub fn upsample_bilinear(x: Tensor<4>, factor: usize) -> Tensor<4> {
    let [_, _, h, w] = x.dims();
    let device = x.device();
    // [1, 1, factor h, h] x [N, C, h, w] x [1, 1, w, factor w]
    let rows = interpolation_matrix(h, factor, &device);
    let columns = interpolation_matrix(w, factor, &device).swap_dims(2, 3);
    rows.matmul(x).matmul(columns)
}

/// Row i holds the linear weights of sample i of a signal up-sampled `factor` times,
/// [1, 1, factor * length, length].
fn interpolation_matrix(length: usize, factor: usize, device: &Device) -> Tensor<4> {
    let fine = factor * length;
    let mut weights = vec![0.0_f32; fine * length];
    for i in 0..fine {
        let at = ((i as f32 + 0.5) / factor as f32 - 0.5).clamp(0.0, (length - 1) as f32);
        let low = at as usize;
        let fraction = at - low as f32;
        weights[i * length + low] += 1.0 - fraction;
        weights[i * length + (low + 1).min(length - 1)] += fraction;
    }
    Tensor::<1>::from_floats(weights.as_slice(), device).reshape([1, 1, fine, length])
}

/// Space to depth: [N, C, H, W] -> [N, C * block^2, H / block, W / block], channel order
/// (c, row in the block, column in the block).
pub fn space_to_depth(x: Tensor<4>, block: usize) -> Tensor<4> {
    let [n, c, h, w] = x.dims();
    let (rows, columns) = (h / block, w / block);
    let split: Tensor<6> = x.reshape([n, c, rows, block, columns, block]);
    split
        .permute([0, 1, 3, 5, 2, 4])
        .reshape([n, c * block * block, rows, columns])
}

/// Depth to space, the inverse of [`space_to_depth`]:
/// [N, C * block^2, h, w] -> [N, C, h * block, w * block].
pub fn depth_to_space(x: Tensor<4>, block: usize) -> Tensor<4> {
    let [n, c, h, w] = x.dims();
    let channels = c / (block * block);
    let split: Tensor<6> = x.reshape([n, channels, block, block, h, w]);
    split
        .permute([0, 1, 4, 2, 5, 3])
        .reshape([n, channels, h * block, w * block])
}
