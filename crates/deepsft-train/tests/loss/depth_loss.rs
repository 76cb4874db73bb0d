//! The loss of step 2 by hand.

use crate::loss::DepthLoss;
use burn::tensor::Device;
use burn::tensor::Tensor;
use deepsft::DepthRange;

#[test]
fn only_what_the_sensor_measured_counts() {
    let device = Device::flex();
    let row = |values: [f32; 4]| Tensor::<1>::from_floats(values, &device).reshape([1, 1, 1, 4]);
    let (depth, measured) = (row([1.0, 2.0, 4.0, 9.0]), row([0.0, 2.5, 0.0, 9.0]));
    let counts = row([1.0, 1.0, 0.0, 1.0]);
    let loss = |total_variation| -> f32 {
        let loss = DepthLoss {
            total_variation,
            unit_mm: None,
        };
        loss.apply(
            depth.clone(),
            measured.clone(),
            counts.clone(),
            None,
            DepthRange::default(),
        )
        .into_scalar()
    };
    // 1 + 0.25; only the first two pixels are neighbours that both count: |2 - 1|^2 * 0.5. Three pixels count.
    assert!((loss(0.0) - 1.25 / 3.0).abs() < 1e-6);
    assert!((loss(0.5) - 1.75 / 3.0).abs() < 1e-6);
}

#[test]
fn outside_the_depth_is_to_be_minus_one_and_depths_are_in_the_losss_unit() {
    let device = Device::flex();
    let row = |values: [f32; 4]| Tensor::<1>::from_floats(values, &device).reshape([1, 1, 1, 4]);
    let loss = DepthLoss {
        total_variation: 0.0,
        // A tenth of the range: an error of 0.1 is one.
        unit_mm: Some(105.0),
    };
    let range = DepthRange::default();
    assert_eq!(range.span_mm(), 1050.0);
    let (depth, measured) = (row([0.5, 0.2, -0.8, 0.3]), row([0.4, 0.2, 0.0, 0.0]));
    let (counts, outside) = (row([1.0, 1.0, 0.0, 0.0]), row([0.0, 0.0, 1.0, 0.0]));
    let loss = loss.apply(depth, measured, counts, Some(outside), range);
    // 1 + 0 and (10 * 0.2)^2, over three pixels.
    assert!((loss.into_scalar::<f32>() - 5.0 / 3.0).abs() < 1e-4);
}
