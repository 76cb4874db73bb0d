//! What follows the network: the mesh fitted to one frame, and followed through a clip. One thread does it all.

use super::workload::{self, CLIP_FRAMES};
use crate::measuring::{Times, timed};
use crate::reading;
use anyhow::{Context, Result, ensure};
use deepsft::ModelBundle;
use deepsft_geometry::fitting::{FrameFitter, Start};
use deepsft_geometry::tracking::{TrackUpdate, Tracker, TrackerImage};
use deepsft_geometry::{CompletionOptions, Maps, MapsCompletion};
use serde::Serialize;

/// Milliseconds of each stage.
#[derive(Serialize)]
pub struct MeshTimes {
    pub frames: usize,
    /// Fitting the mesh to a frame on its own, from the network's maps.
    pub fit: Times,
    /// ARAP completion of a frame on its own, from the network's maps, with drawing the mesh.
    pub completion: Times,
    /// The start of a track from the network's maps of the newest frame.
    pub track_start: Times,
    /// One frame followed.
    pub track: Times,
}

/// Measures on the frames of [`workload::clip`].
pub fn measure(bundle: &ModelBundle) -> Result<MeshTimes> {
    let estimator = reading::estimator(bundle)?;
    let camera = *estimator.training_camera();
    let frames = workload::clip(bundle)?;
    let maps: Vec<Maps> = frames
        .iter()
        .map(|image| pollster::block_on(estimator.infer(image, &camera)))
        .collect::<Result<_, _>>()?;

    let mut fitter = FrameFitter::new(bundle.template())?;
    let mut arap = MapsCompletion::new(bundle.template().mesh(), CompletionOptions::default())?;
    let (mut fit, mut completion) = (Vec::new(), Vec::new());
    let (mut track_start, mut track) = (Vec::new(), Vec::new());
    for (image, maps) in frames.iter().zip(&maps) {
        let start = Start::Maps(maps.clone());
        let (fitted, ms) = timed(|| fitter.fit(image, &camera, &start))?;
        ensure!(fitted.is_some(), "the network did not find the template in the clip");
        fit.push(ms);
        let (completed, ms) = timed(|| arap.complete(maps, &camera))?;
        ensure!(
            completed.is_some(),
            "the network shows too little of the template in the clip"
        );
        completion.push(ms);
    }
    let mut tracker = Tracker::new(bundle.template())?;
    for (k, (image, maps)) in frames.iter().zip(&maps).enumerate() {
        tracker.reset();
        tracker.follow(k as u64, k as f64, &TrackerImage::of(image), &camera)?;
        let (answer, ms) = timed(|| -> Result<TrackUpdate> {
            let seen = fitter.initial_mesh(&camera, &Start::Maps(maps.clone()))?;
            Ok(tracker.update(k as u64, seen.as_deref())?)
        })?;
        ensure!(
            answer == TrackUpdate::Started,
            "the tracker did not start on frame {k} of the clip"
        );
        track_start.push(ms);
    }
    tracker.reset();
    for (k, image) in frames.iter().enumerate() {
        let (found, ms) = timed(|| {
            let image = TrackerImage::of_into(image, tracker.spare_image());
            tracker
                .follow(k as u64, k as f64 / 30.0, &image, &camera)
                .map(|t| t.surface.is_some())
        })?;
        if k == 0 {
            let seen = fitter.initial_mesh(&camera, &Start::Maps(maps[0].clone()))?;
            tracker.update(0, seen.as_deref())?;
        } else {
            ensure!(found, "the tracker lost frame {k} of the clip");
            track.push(ms);
        }
    }
    let times = |times: Vec<f64>| Times::of(&times).context("nothing was measured");
    Ok(MeshTimes {
        frames: CLIP_FRAMES,
        fit: times(fit)?,
        completion: times(completion)?,
        track_start: times(track_start)?,
        track: times(track)?,
    })
}
