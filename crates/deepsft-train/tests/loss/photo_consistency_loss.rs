//! The loss of step 3 by hand.

use crate::loss::{Light, PhotoConsistencyLoss, Residual, TexturePyramid};
use burn::tensor::Device;
use burn::tensor::Tensor;
use deepsft_geometry::Picture;

/// The loss summed over the seven pixels inside: of a texture of two grey texels, 100 and 120, each seen in two of four
/// columns, in two rows.
fn loss(images: [f32; 8], config: PhotoConsistencyLoss) -> f64 {
    let device = Device::flex();
    let texture = TexturePyramid::new(&Picture::from_fn(2, 1, |x, _| [100 + 20 * x as u8; 3]), &device);
    let u = [0.25, 0.25, 0.75, 0.75];
    let registration: Vec<f32> = [u, u, [0.5; 4], [0.5; 4]].concat();
    let registration = Tensor::<1>::from_floats(registration.as_slice(), &device).reshape([1, 2, 2, 4]);
    let one = images.map(|value| value / 255.0);
    let images = Tensor::<1>::from_floats([one, one, one].concat().as_slice(), &device).reshape([1, 3, 2, 4]);
    // The last pixel is outside.
    let inside = Tensor::<1>::from_floats([1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 0.0], &device).reshape([1, 1, 2, 4]);
    7.0 * f64::from(
        config
            .apply(registration, &images, &inside, &texture, &[0])
            .into_scalar::<f32>(),
    )
}

const PRINTED: PhotoConsistencyLoss = PhotoConsistencyLoss {
    cauchy_scale: 4.0,
    residual: Residual::Squared,
    half_size: 0.5,
    total_variation: 0.0,
    light: Light::Ignored,
};

const SAME: [f32; 8] = [100.0, 100.0, 120.0, 120.0, 100.0, 100.0, 120.0, 0.0];

#[test]
fn both_scales_count_with_the_cauchy_estimator_of_the_squared_difference() {
    assert!(loss(SAME, PRINTED).abs() < 1e-6, "what is outside does not count");
    // One pixel two grey levels off: x = 4, chi = 8 ln 2. Its four of the half-size image are 1/2 off: x = 1/4,
    // chi = 8 ln(1 + 1/256); the other four hold the pixel outside. Three colours.
    let mut off = SAME;
    off[0] += 2.0;
    let expected = 3.0 * (8.0 * 2.0_f64.ln() + 0.5 * 8.0 * (1.0 + 1.0 / 256.0_f64).ln());
    assert!((loss(off, PRINTED) / expected - 1.0).abs() < 1e-4);
    let plain = PhotoConsistencyLoss {
        residual: Residual::Plain,
        half_size: 0.0,
        ..PRINTED
    };
    // x = 2: chi = 8 ln(1 + 1/4).
    let expected = 3.0 * 8.0 * 1.25_f64.ln();
    assert!((loss(off, plain) / expected - 1.0).abs() < 1e-4);
}

#[test]
fn the_registrations_total_variation_is_added() {
    let smooth = PhotoConsistencyLoss {
        total_variation: 0.01,
        ..PRINTED
    };
    // u steps by 1/2 once in each row, v never.
    assert!((loss(SAME, smooth) - 0.01).abs() < 1e-6);
}
