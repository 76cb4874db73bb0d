//! What is measured on: a compact network, one camera frame, and a clip that the mesh is followed through.

use anyhow::{Context, Result, bail};
use burn::tensor::Device;
use deepsft::ModelBundle;
use deepsft_geometry::{Camera, Picture};
use deepsft_network::{CompactNetwork, Network};
use deepsft_synth::{ClipMotion, FIRST_CLIP_SEED, SynthConfig, Synthesizer};

/// What browsers and phones deliver when asked for video.
const WIDTH: usize = 1280;
const HEIGHT: usize = 720;

/// Seed of the frame; no training or evaluation uses it.
const FRAME_SEED: u64 = 0xbe_4c;

/// Fraction of the frame that the template covers at least, so that confidence has work to do.
const MIN_AREA: f64 = 0.15;

/// Frames that are tried.
const TRIES: u64 = 100;

/// Seed of the clip; no training or evaluation uses it.
const CLIP_SEED: u64 = FIRST_CLIP_SEED + 0xbe_4c;

/// Frames of the clip that are measured.
pub const CLIP_FRAMES: usize = 24;

/// Frames of the whole loop: 30 a second, as the demo's clip.
const LOOP_FRAMES: usize = 300;

/// The camera of the frame: the training camera with more pixels.
pub fn camera(bundle: &ModelBundle) -> Result<Camera> {
    Ok(bundle.camera().resized((WIDTH, HEIGHT))?)
}

/// The first synthetic frame of the bundle's template that shows enough of it.
pub fn camera_frame(bundle: &ModelBundle) -> Result<Picture> {
    let config = SynthConfig {
        camera: camera(bundle)?,
        ..SynthConfig::default()
    };
    let synthesizer = Synthesizer::new(bundle.template(), config)?;
    let least = (MIN_AREA * WIDTH as f64 * HEIGHT as f64) as usize;
    let mut samples = (0..TRIES).map(|index| synthesizer.sample(FRAME_SEED, index));
    let sample = samples.find(|sample| sample.truth.area() >= least);
    Ok(sample.context("no synthetic frame shows enough of the template")?.image)
}

/// The frames, as the canonical camera takes them.
pub fn clip(bundle: &ModelBundle) -> Result<Vec<Picture>> {
    let camera = *bundle.camera();
    let motion = ClipMotion::new(bundle.template(), &camera, CLIP_SEED);
    let synthesizer = Synthesizer::new(bundle.template(), SynthConfig::for_clips(camera))?;
    let scene = synthesizer.scene(CLIP_SEED, 0);
    let render = |k: usize| scene.render(motion.vertices_camera(k as f64 / LOOP_FRAMES as f64), k as u64);
    (0..CLIP_FRAMES).map(|k| Ok(render(k)?.image)).collect()
}

/// The compact network of `bundle`: the other programs know how to write down no other.
pub fn compact_network(bundle: &ModelBundle, device: &Device) -> Result<CompactNetwork> {
    match Network::from_folded(bundle.network(), device)? {
        Network::Compact(network) => Ok(network),
        other => {
            let name = other.config().architecture.name();
            bail!("only compact networks are compared with other programs, this one's architecture is {name}")
        }
    }
}
