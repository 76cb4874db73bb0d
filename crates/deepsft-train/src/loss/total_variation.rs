//! Total variation of maps, squared as the paper prints it: || nabla x ||_1^2.

use burn::tensor::Tensor;

/// The squared total variation of each image's maps, summed over images, [1]: with |nabla x| the sum of the absolute
/// differences to the right and lower neighbours, (sum over channels and pixels of |nabla x|)^2.
///
/// `maps` [N, C, H, W]; `inside` [N, 1, H, W], 0 or 1: only differences between two pixels inside count (our choice: the
/// object's outline is no noise).
pub fn squared_total_variation(maps: Tensor<4>, inside: Tensor<4>) -> Tensor<1> {
    // Of neighbours along a dimension, for each image: [N, 1].
    let along = |dimension: usize| -> Tensor<2> {
        let length = maps.dims()[dimension];
        // A map of one row has nothing below; empty tensors cannot be reshaped.
        if length < 2 {
            return Tensor::zeros([maps.dims()[0], 1], &maps.device());
        }
        let neighbours = |x: &Tensor<4>| [1, 0].map(|first| x.clone().narrow(dimension, first, length - 1));
        let ([next, one], [next_inside, one_inside]) = (neighbours(&maps), neighbours(&inside));
        let counted: Tensor<2> = ((next - one).abs() * (next_inside * one_inside)).flatten(1, 3);
        counted.sum_dim(1)
    };
    (along(3) + along(2)).square().sum()
}
