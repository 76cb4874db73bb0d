//! The network beside the tracker: which frames the network sees, and when its detections arrive.

use deepsft::session::{Detection, SessionOptions, VideoFollower, VideoOptions};
use deepsft::{
    Accuracy, Device, DeviceKind, Finder, FoundRule, ModelBundle, ModelCard, NetworkConfig, Provenance, Target,
    TargetFinder, View,
};
use deepsft_geometry::tracking::TrackUpdate;
use deepsft_geometry::{Picture, Template, training_camera};
use deepsft_network::{Network, start_device};
use std::sync::atomic::{AtomicU32, Ordering};

/// A bundle of a network that was never trained.
fn bundle() -> ModelBundle {
    let (device, _) = pollster::block_on(start_device(DeviceKind::Cpu)).unwrap();
    let camera = training_camera();
    let texture = Picture::from_fn(40, 30, |x, y| [(6 * x) as u8, (8 * y) as u8, (x * y % 251) as u8]);
    let card = ModelCard {
        name: "untrained".to_owned(),
        licence: Some("MIT OR Apache-2.0".to_owned()),
        found: FoundRule::default(),
        provenance: Provenance::default(),
        accuracy: Accuracy::default(),
    };
    let network = Network::new(&NetworkConfig::compact([200.0, 150.0], &camera), &device);
    ModelBundle::new(
        network.folded(),
        Template::thin_shell(texture, 200.0, 150.0).unwrap(),
        camera,
        card,
    )
}

/// For each of some grey frames, whether the network ran on it and of which frame a detection arrived. The clock ticks by a
/// millisecond at each look.
fn schedule(ask_every: Option<u64>, delay: u64, frames: usize) -> Vec<(bool, Option<u64>)> {
    let bundle = bundle();
    let target = Target::from_model(&bundle, &Device::Cpu).unwrap();
    let network = Finder::Network(Box::new(target.network().unwrap().clone()));
    let mut finder = TargetFinder::with_finders(target, vec![network]);
    let ticks = AtomicU32::new(0);
    let clock = || f64::from(ticks.fetch_add(1, Ordering::Relaxed) + 1);
    let options = VideoOptions {
        session: SessionOptions {
            ask_every,
            ..SessionOptions::default()
        },
        delay,
        ..VideoOptions::default()
    };
    let mut video = VideoFollower::new(&mut finder, options, clock).unwrap();
    let (image, camera) = (Picture::from_fn(480, 270, |_, _| [120; 3]), training_camera());
    let of_frame = |detection: Detection| {
        // A grey frame shows nothing: there is nothing to start from.
        assert_eq!(detection.effect, TrackUpdate::Ignored);
        detection.of_frame
    };
    (0..frames)
        .map(|frame| {
            let followed =
                pollster::block_on(video.follow(frame as f64 / 30.0, &mut View::new(&image, &camera))).unwrap();
            let times = followed.times;
            assert!(!followed.followed.found);
            assert_eq!(times.follow, 1.0);
            assert_eq!(times.catch_up, followed.detection.map(|_| 1.0));
            (times.finding.is_some(), followed.detection.map(of_frame))
        })
        .collect()
}

#[test]
fn a_delayed_network_starts_on_the_newest_frame_when_its_detection_has_arrived() {
    let expected = [
        (true, None),
        (false, None),
        (true, Some(0)),
        (false, None),
        (true, Some(2)),
    ];
    assert_eq!(schedule(None, 2, 5), expected);
}

#[test]
fn a_network_that_is_waited_for_detects_at_once() {
    let expected = [(true, Some(0)), (false, None), (false, None), (true, Some(3))];
    assert_eq!(schedule(Some(3), 0, 4), expected);
    assert_eq!(schedule(None, 0, 2), [(true, Some(0)), (true, Some(1))]);
}
