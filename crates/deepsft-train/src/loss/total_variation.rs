//! Total variation of maps, squared as the paper prints it: || nabla x ||_1^2.

use burn::tensor::Tensor;

/// The squared total variation of each image's maps, summed over images, [1]: with |nabla x| the sum of the absolute
/// differences to the right and lower neighbours, (sum over channels and pixels of |nabla x|)^2.
///
/// `maps` [N, C, H, W]; `inside` [N, 1, H, W], 0 or 1: only differences between two pixels inside count (our choice: the
/// object's outline is no noise).
pub fn squared_total_variation(maps: Tensor<4>, inside: Tensor<4>) -> Tensor<1> {
    let [n, c, h, w] = maps.dims();
    let across = maps.clone().slice([0..n, 0..c, 0..h, 1..w]) - maps.clone().slice([0..n, 0..c, 0..h, 0..w - 1]);
    let both_across =
        inside.clone().slice([0..n, 0..1, 0..h, 1..w]) * inside.clone().slice([0..n, 0..1, 0..h, 0..w - 1]);
    let down = maps.clone().slice([0..n, 0..c, 1..h, 0..w]) - maps.slice([0..n, 0..c, 0..h - 1, 0..w]);
    let both_down = inside.clone().slice([0..n, 0..1, 1..h, 0..w]) * inside.slice([0..n, 0..1, 0..h - 1, 0..w]);
    let an_image = |differences: Tensor<4>, both: Tensor<4>| -> Tensor<2> {
        let [_, _, rows, columns] = differences.dims();
        // A map of one row has nothing below; empty tensors cannot be reshaped.
        if rows * columns == 0 {
            return Tensor::zeros([n, 1], &differences.device());
        }
        (differences.abs() * both).reshape([n, c * rows * columns]).sum_dim(1) // [N, 1]
    };
    (an_image(across, both_across) + an_image(down, both_down))
        .square()
        .sum()
}
