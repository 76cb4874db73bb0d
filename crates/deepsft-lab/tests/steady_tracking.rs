//! A video that goes on and on takes no more and more memory. Alone in its program: it counts what is allocated.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use deepsft::session::{SessionOptions, VideoFollower, VideoOptions};
use deepsft::{Target, TargetFinder, View};
use deepsft_geometry::tracking::OneEuroOptions;
use deepsft_geometry::training_camera;
use deepsft_synth::{ClipEvent, ClipLength, ClipStory, FIRST_CLIP_SEED, Sample, SynthConfig, Synthesizer, clip_frames};
use std::path::Path;

/// Frames of a clip.
const FRAMES: usize = 16;

/// Frames of a loop, some of which would leave something behind if anything did.
const LOOP: usize = 4 * FRAMES;

/// Bytes that a loop may keep more than the one before, since it ends with other matches under way. One that kept 32 numbers of a
/// frame would keep more.
const MAX_KEPT: i64 = 16_000;

#[test]
fn a_loop_of_losses_and_returns_leaves_no_memory_behind() {
    let model = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../models/poster-a4/template");
    let template = deepsft_formats::read_template(&model).unwrap();
    let camera = training_camera();
    let synthesizer = Synthesizer::new(&template, SynthConfig::for_clip_stories(camera)).unwrap();
    let length = ClipLength {
        frames: FRAMES,
        ..ClipLength::default()
    };
    let clips = [ClipEvent::JumpCut, ClipEvent::Leaving].map(|event| -> Vec<Sample> {
        let story = ClipStory::new(&synthesizer, length.clone(), event, FIRST_CLIP_SEED).unwrap();
        clip_frames(&story, 0..FRAMES).map(Result::unwrap).collect()
    });
    let there_and_back = |clip: &'_ Vec<Sample>| {
        (0..2 * FRAMES)
            .map(|k| clip[k.min(2 * FRAMES - 1 - k)].image.clone())
            .collect::<Vec<_>>()
    };
    let images: Vec<_> = clips.iter().flat_map(there_and_back).collect();
    let mut finder = TargetFinder::new(Target::from_template(template)).unwrap();
    let options = VideoOptions {
        session: SessionOptions {
            smoothing: Some(OneEuroOptions::default()),
            // A loop begins as the one before.
            ask_every: Some(4),
        },
        delay: 3,
        ..VideoOptions::default()
    };
    let mut tracker = VideoFollower::new(&mut finder, options, || 0.0).unwrap();
    let (mut number, mut found) = (0, 0);
    let mut a_loop = || {
        for image in &images {
            let mut view = View::new(image, &camera);
            let frame = pollster::block_on(tracker.follow(f64::from(number) / 30.0, &mut view)).unwrap();
            number += 1;
            found += usize::from(frame.followed.found);
        }
    };
    // Everything that is made once, and the frames that are remembered.
    a_loop();
    let kept: Vec<i64> = (0..3)
        .map(|_| allocation_counter::measure(&mut a_loop).bytes_current)
        .collect();
    assert!(kept.iter().sum::<i64>().abs() < MAX_KEPT, "{kept:?}");
    assert!(
        found > 2 * LOOP && found < 4 * LOOP,
        "found in {found} of {} frames",
        4 * LOOP
    );
}
