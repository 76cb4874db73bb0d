//! The camera frame that inference is measured on.

use anyhow::{Context, Result};
use deepsft::ModelBundle;
use deepsft_geometry::{Camera, Picture};
use deepsft_synth::{SynthConfig, Synthesizer};

/// What browsers and phones deliver when asked for video.
const WIDTH: u32 = 1280;
const HEIGHT: u32 = 720;

/// Seed of the frame; no training or evaluation uses it.
const SEED: u64 = 0xbe_4c;

/// Share of the frame that the template covers at least, so that confidence has work to do.
const LEAST_AREA: f64 = 0.15;

/// Frames that are tried.
const TRIES: u64 = 100;

/// The camera of the frame: the training camera with more pixels.
pub fn camera(bundle: &ModelBundle) -> Result<Camera> {
    Ok(bundle.camera().resized(WIDTH, HEIGHT)?)
}

/// The first synthetic frame of the bundle's template that shows enough of it.
pub fn camera_frame(bundle: &ModelBundle) -> Result<Picture> {
    let config = SynthConfig {
        camera: camera(bundle)?,
        ..SynthConfig::default()
    };
    let synthesizer = Synthesizer::new(bundle.template(), config)?;
    let least = (LEAST_AREA * f64::from(WIDTH) * f64::from(HEIGHT)) as usize;
    let mut samples = (0..TRIES).map(|index| synthesizer.sample(SEED, index));
    let sample = samples.find(|sample| sample.truth.area() >= least);
    Ok(sample.context("no synthetic frame shows enough of the template")?.image)
}
