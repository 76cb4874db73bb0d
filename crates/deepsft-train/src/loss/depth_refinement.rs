//! The loss of training step 2 (paper, equation `depthloss`): depth against what a sensor measured.

use super::mean_over;
use super::total_variation::squared_total_variation;
use burn::tensor::Tensor;
use deepsft::DepthRange;
use deepsft_network::OUTSIDE;
use serde::Serialize;

/// Squared depth error and total variation.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct DepthLoss {
    /// Weight lambda of the squared total variation. The paper's 1e-9 is the default.
    pub total_variation: f64,
    /// Unit of the depths in the loss, mm; `None` is that of normalised depth ([`deepsft::DepthRange::span_mm`]).
    pub unit_mm: Option<f64>,
}

impl DepthLoss {
    /// The loss, [1]: sum_i || rho_i - rho*_i ||_F^2 + lambda sum_i || nabla rho_i ||_1^2 over the pixels that count, depths in
    /// [`DepthLoss::unit_mm`], divided by their number.
    ///
    /// `depth` and `measured` [N, 1, H, W] are normalised depths of `range`; `counts` [N, 1, H, W], 0 or 1: the object is
    /// seen there and the sensor measured it; `outside` likewise where it is not: there the depth is to be [`OUTSIDE`], as
    /// the paper's labels are. A network whose mask is not read from its depth needs none.
    pub(crate) fn apply(
        &self,
        depth: Tensor<4>,
        measured: Tensor<4>,
        counts: Tensor<4>,
        outside: Option<Tensor<4>>,
        range: DepthRange,
    ) -> Tensor<1> {
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
        mean_over(counted, data, smoothness)
    }
}
