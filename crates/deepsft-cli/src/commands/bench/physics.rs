//! What follows the network: the mesh fitted to one frame, and followed through a clip. One thread does it all.

use super::turns::{Times, timed};
use crate::input;
use anyhow::{Context, Result, ensure};
use deepsft::{DeviceKind, ModelBundle};
use deepsft_geometry::physics::{PhysicsOptions, PhysicsRefinement};
use deepsft_geometry::tracking::{Answer, Tracker, TrackingOptions};
use deepsft_geometry::{Maps, Picture};
use deepsft_synth::{ClipConfig, ClipMotion, FIRST_CLIP_SEED, SynthConfig, Synthesizer};
use serde::Serialize;

/// Seed of the clip; no training or evaluation uses it.
const SEED: u64 = FIRST_CLIP_SEED + 0xbe_4c;

/// Frames of the clip that are measured.
pub const FRAMES: usize = 24;

/// Frames of the whole loop: 30 a second, as the demo's clip.
const LOOP: usize = 300;

/// Milliseconds of each stage.
#[derive(Serialize)]
pub struct Physics {
    pub frames: usize,
    /// Physics refinement of a frame on its own, from the network's maps.
    pub refinement: Times,
    /// The start of a track from the network's maps of the newest frame.
    pub track_start: Times,
    /// One frame followed.
    pub track: Times,
}

/// The frames, as the canonical camera takes them.
pub fn clip(bundle: &ModelBundle) -> Result<Vec<Picture>> {
    let camera = *bundle.camera();
    let motion = ClipMotion::new(bundle.template(), &camera, ClipConfig::default(), SEED);
    let synthesizer = Synthesizer::new(bundle.template(), SynthConfig::for_clips(camera))?;
    let scene = synthesizer.scene(SEED, 0);
    let render = |k: usize| scene.render(motion.vertices_camera(k as f64 / LOOP as f64), k as u64);
    (0..FRAMES).map(|k| Ok(render(k)?.image)).collect()
}

/// Measures on the frames of [`clip`].
pub fn measure(bundle: &ModelBundle) -> Result<Physics> {
    let (estimator, _) = input::estimator(bundle, DeviceKind::Cpu)?;
    let camera = *estimator.canonical_camera();
    let frames = clip(bundle)?;
    let maps: Vec<Maps> = frames
        .iter()
        .map(|image| pollster::block_on(estimator.infer(image)))
        .collect::<Result<_, _>>()?;

    let mut physics = PhysicsRefinement::new(bundle.template(), PhysicsOptions::default())?;
    let (mut refinement, mut track_start, mut track) = (Vec::new(), Vec::new(), Vec::new());
    for (image, maps) in frames.iter().zip(&maps) {
        let mut ms = 0.0;
        let refined = timed(&mut ms, || physics.refine(image, &camera, maps, None))?;
        ensure!(refined.is_some(), "the network did not find the template in the clip");
        refinement.push(ms);
    }
    let mut tracker = Tracker::new(bundle.template(), TrackingOptions::default())?;
    for (k, (image, maps)) in frames.iter().zip(&maps).enumerate() {
        tracker.reset();
        tracker.follow(k as u64, k as f64, image, &camera)?;
        let mut ms = 0.0;
        let answer = timed(&mut ms, || tracker.answer(k as u64, Some(maps)))?;
        ensure!(
            answer == Answer::Started,
            "the tracker did not start on frame {k} of the clip"
        );
        track_start.push(ms);
    }
    tracker.reset();
    for (k, image) in frames.iter().enumerate() {
        let mut ms = 0.0;
        let found = timed(&mut ms, || {
            tracker
                .follow(k as u64, k as f64 / 30.0, image, &camera)
                .map(|t| t.found)
        })?;
        if k == 0 {
            tracker.answer(0, maps.first())?;
        } else {
            ensure!(found, "the tracker lost frame {k} of the clip");
            track.push(ms);
        }
    }
    let times = |times: Vec<f64>| Times::of(times).context("nothing was measured");
    Ok(Physics {
        frames: FRAMES,
        refinement: times(refinement)?,
        track_start: times(track_start)?,
        track: times(track)?,
    })
}
