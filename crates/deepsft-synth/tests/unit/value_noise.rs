//! Smooth noise.

use crate::painting::ValueNoise;
use crate::random::{Stream, generator};
use deepsft_geometry::glam::Vec2;

#[test]
fn value_noise_is_smooth_and_fills_its_range() {
    let noise = ValueNoise::new(&mut generator(5, 0, Stream::Scene));
    let values: Vec<f32> = (0..20_000)
        .map(|i| noise.at(Vec2::new(i as f32 * 0.01, i as f32 * 0.003)))
        .collect();
    assert!(values.iter().all(|v| v.abs() <= 1.0));
    assert!(values.iter().any(|&v| v > 0.7) && values.iter().any(|&v| v < -0.7));
    // Slope of value noise: at most 1.5 * 2 a unit along each axis.
    assert!(values.windows(2).all(|v| (v[1] - v[0]).abs() < 3.0 * 0.0131));
}
