//! An object with a volume that bends is followed all around.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use deepsft_geometry::tracking::{TrackUpdate, Tracker, TrackerImage};
use deepsft_geometry::training_camera;
use deepsft_synth::{ClipEvent, ClipLength, ClipStory, FIRST_CLIP_SEED, SynthConfig, Synthesizer, clip_frames};
use deepsft_train::tracking_errors::{TRACKED_PX, mesh_errors};

const FRAMES: usize = 90;

#[test]
fn a_soft_toy_that_bends_and_turns_once_around_is_followed() {
    let template = deepsft_formats::read_template(&deepsft_tests::root().join("models/soft-toy/template")).unwrap();
    let camera = training_camera();
    let synthesizer = Synthesizer::new(&template, SynthConfig::for_clip_stories(camera)).unwrap();
    let length = ClipLength {
        frames: FRAMES,
        ..ClipLength::default()
    };
    let story = ClipStory::new(&synthesizer, length, ClipEvent::Turning, FIRST_CLIP_SEED + 1003).unwrap();
    let mut tracker = Tracker::new(&template).unwrap();
    let mut tracked = 0;
    for (k, sample) in clip_frames(&story, 0..FRAMES).enumerate() {
        let sample = sample.unwrap();
        let image = TrackerImage::of(&sample.image);
        tracker.follow(k as u64, k as f64 / 30.0, &image, &camera).unwrap();
        if k == 0 {
            let update = tracker.update(0, Some(&sample.vertices_camera)).unwrap();
            assert_eq!(update, TrackUpdate::Started);
        }
        let Some(surface) = &tracker.current().surface else {
            continue;
        };
        let errors = mesh_errors(&template, &surface.vertices_camera, &sample.truth, &camera).unwrap();
        tracked += usize::from(errors.registration_rmse_px.is_some_and(|px| px <= TRACKED_PX));
    }
    assert!(
        tracked * 100 >= FRAMES * 90,
        "{tracked} of {FRAMES} frames within {TRACKED_PX} px"
    );
}
