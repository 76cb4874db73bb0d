//! The loss of training step 2 (paper, equation `depthloss`): depth against what a sensor measured.

use super::total_variation::squared_total_variation;
use super::{Reduction, TuningLoss};
use burn::tensor::Tensor;
use deepsft::{DepthRange, OUTSIDE};
use serde::Serialize;

/// Squared depth error and total variation.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct DepthLoss {
    /// Weight lambda of the squared total variation. The paper's 1e-9 is the default.
    pub total_variation: f64,
    /// What the sums are divided by.
    pub reduction: Reduction,
    /// Unit of the depths in the loss, mm; `None` is that of normalised depth ([`deepsft::DepthRange::span_mm`]).
    pub unit_mm: Option<f64>,
}

impl DepthLoss {
    /// sum_i || rho_i - rho*_i ||_F^2 + lambda sum_i || nabla rho_i ||_1^2 over the pixels that count, depths in
    /// [`DepthLoss::unit_mm`].
    ///
    /// `depth` and `measured` [N, 1, H, W] are normalised depths of `range`; `counts` [N, 1, H, W], 0 or 1: the object is
    /// seen there and the sensor measured it; `outside` likewise where it is not: there the depth is to be [`OUTSIDE`], as
    /// the paper's labels are. A network whose mask is not read from its depth needs none.
    pub fn apply(
        &self,
        depth: Tensor<4>,
        measured: Tensor<4>,
        counts: Tensor<4>,
        outside: Option<Tensor<4>>,
        range: DepthRange,
    ) -> TuningLoss {
        let scaled = |x: Tensor<4>| match self.unit_mm {
            Some(unit_mm) => x * (range.span_mm() / unit_mm),
            None => x,
        };
        let mut data = (scaled(depth.clone() - measured).square() * counts.clone()).sum();
        let smoothness = squared_total_variation(scaled(depth.clone()), counts.clone()) * self.total_variation;
        let mut counted = counts;
        if let Some(outside) = outside {
            data = data + (scaled(depth - OUTSIDE).square() * outside.clone()).sum();
            counted = counted + outside;
        }
        TuningLoss::reduced(data, smoothness, counted, self.reduction)
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
                unit_mm: None,
            };
            loss.apply(
                depth.clone(),
                measured.clone(),
                counts.clone(),
                None,
                DepthRange::default(),
            )
        };
        // 1 + 0.25; only the first two pixels are neighbours that both count: |2 - 1|^2 * 0.5.
        assert_eq!(loss(Reduction::Sum).data.into_scalar::<f32>(), 1.25);
        assert_eq!(loss(Reduction::Sum).total.into_scalar::<f32>(), 1.75);
        assert!((loss(Reduction::Mean).total.into_scalar::<f32>() - 1.75 / 3.0).abs() < 1e-6);
    }

    #[test]
    fn outside_the_depth_is_to_be_minus_one_and_depths_are_in_the_losss_unit() {
        let device = Device::flex();
        let row = |values: [f32; 4]| Tensor::<1>::from_floats(values, &device).reshape([1, 1, 1, 4]);
        let loss = DepthLoss {
            total_variation: 0.0,
            reduction: Reduction::Mean,
            // A tenth of the range: an error of 0.1 is one.
            unit_mm: Some(105.0),
        };
        let range = DepthRange::default();
        assert_eq!(range.span_mm(), 1050.0);
        let (depth, measured) = (row([0.5, 0.2, -0.8, 0.3]), row([0.4, 0.2, 0.0, 0.0]));
        let (counts, outside) = (row([1.0, 1.0, 0.0, 0.0]), row([0.0, 0.0, 1.0, 0.0]));
        let loss = loss.apply(depth, measured, counts, Some(outside), range);
        // 1 + 0 and (10 * 0.2)^2, over three pixels.
        assert!((loss.total.into_scalar::<f32>() - 5.0 / 3.0).abs() < 1e-4);
    }
}
