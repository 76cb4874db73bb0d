//! The loss of training step 2 (paper, equation `depthloss`): depth against what a sensor measured.

use super::total_variation::squared_total_variation;
use super::{Reduction, RefinementLoss};
use burn::tensor::Tensor;

/// Squared depth error and total variation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DepthLoss {
    /// Weight lambda of the squared total variation. The paper's 1e-9 is the default.
    pub total_variation: f64,
    /// What the sums are divided by.
    pub reduction: Reduction,
}

impl DepthLoss {
    /// sum_i || rho_i - rho*_i ||_F^2 + lambda sum_i || nabla rho_i ||_1^2 over the pixels that count.
    ///
    /// `depth` and `measured` [N, 1, H, W] in one unit (the network's normalised depth in training); `counts`
    /// [N, 1, H, W], 0 or 1: the object is seen there and the sensor measured it.
    pub fn apply(&self, depth: Tensor<4>, measured: Tensor<4>, counts: Tensor<4>) -> RefinementLoss {
        let data = ((depth.clone() - measured).square() * counts.clone()).sum();
        let smoothness = squared_total_variation(depth, counts.clone()) * self.total_variation;
        RefinementLoss::reduced(data, smoothness, counts, self.reduction)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use burn::tensor::Device;

    #[test]
    fn only_what_the_sensor_measured_counts() {
        let device = Device::flex();
        let row = |values: [f32; 4]| Tensor::<1>::from_floats(values, &device).reshape([1, 1, 1, 4]);
        let (depth, measured) = (row([1.0, 2.0, 4.0, 9.0]), row([0.0, 2.5, 0.0, 9.0]));
        let counts = row([1.0, 1.0, 0.0, 1.0]);
        let loss = |reduction| {
            let loss = DepthLoss {
                total_variation: 0.5,
                reduction,
            };
            loss.apply(depth.clone(), measured.clone(), counts.clone())
        };
        // 1 + 0.25; only the first two pixels are neighbours that both count: |2 - 1|^2 * 0.5.
        assert_eq!(loss(Reduction::Sum).data.into_scalar::<f32>(), 1.25);
        assert_eq!(loss(Reduction::Sum).total.into_scalar::<f32>(), 1.75);
        assert!((loss(Reduction::Mean).total.into_scalar::<f32>() - 1.75 / 3.0).abs() < 1e-6);
    }
}
