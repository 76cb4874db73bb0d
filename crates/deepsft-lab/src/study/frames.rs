//! What studies share: frames with twice the pixels of the canonical image along a side, and how exact fits are.

use crate::measuring::Spread;
use anyhow::Result;
use deepsft_geometry::glam::DVec3;
use deepsft_geometry::{Camera, ImageSize, Surface, training_camera};
use deepsft_synth::SynthConfig;

/// `camera` with twice the pixels along each side: features need more than a network.
pub fn doubled(camera: &Camera) -> Result<Camera> {
    let ImageSize { width, height } = camera.size();
    Ok(camera.resized((2 * width, 2 * height))?)
}

/// How frames of 960 x 540 pixels are made that show the object.
pub fn frames_config() -> Result<SynthConfig> {
    Ok(SynthConfig {
        camera: doubled(&training_camera())?,
        empty_probability: 0.0,
        ..SynthConfig::default()
    })
}

/// Fractions of the vertices within one and two of their stated standard deviations.
pub fn within_deviations(surface: &Surface, truth: &[DVec3]) -> [f64; 2] {
    let ways = surface.vertices_camera.iter().zip(truth).map(|(a, b)| a.distance(*b));
    let stated = surface.deviations.iter().map(|deviation| f64::from(*deviation));
    let multiples: Vec<f64> = ways.zip(stated).map(|(way, deviation)| way / deviation).collect();
    [1.0, 2.0].map(|most| multiples.iter().filter(|multiple| **multiple < most).count() as f64 / truth.len() as f64)
}

/// Median and 95th percentile of errors as a cell of a table.
pub fn cell(errors: Option<Spread>) -> String {
    errors.map_or_else(
        || "-".to_owned(),
        |Spread { median, p95, .. }| format!("**{median:.2}** ({p95:.2})"),
    )
}
