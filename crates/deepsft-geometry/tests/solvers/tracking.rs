//! A swaying, bending sheet is followed from one late answer of a finder.

use crate::sheet::{bent, image, template};
use deepsft_geometry::glam::{DVec2, DVec3};
use deepsft_geometry::metrics::frame_metrics;
use deepsft_geometry::raster::VisibleSurface;
use deepsft_geometry::tracking::{MEMORY, TrackUpdate, Tracker, TrackerImage};
use deepsft_geometry::{Camera, GeometryError, Maps, Picture, Surface, Template, training_camera};

const FRAME_S: f64 = 1.0 / 30.0;

struct Video {
    template: Template,
    camera: Camera,
    tracker: Tracker,
}

impl Video {
    fn new() -> Self {
        let template = template();
        let tracker = Tracker::new(&template).unwrap();
        Self {
            template,
            camera: training_camera(),
            tracker,
        }
    }

    fn vertices(&self, frame: u64) -> Vec<DVec3> {
        bent(&self.template, frame as f64 * FRAME_S)
    }

    fn truth(&self, frame: u64) -> Maps {
        VisibleSurface::new(self.template.mesh(), &self.vertices(frame), &self.camera).maps()
    }

    fn picture(&self, frame: u64) -> Picture {
        image(&self.template, &self.truth(frame))
    }

    fn follow(&mut self, frame: u64, picture: &Picture) -> bool {
        let time_s = frame as f64 * FRAME_S;
        self.tracker
            .follow(frame, time_s, &TrackerImage::of(picture), &self.camera)
            .unwrap()
            .surface
            .is_some()
    }

    /// Registration error of the track in `frame`, pixels.
    fn error_px(&self, frame: u64) -> f64 {
        error_px(&self.tracker, &self.template, &self.truth(frame))
    }
}

/// Registration error of what is followed, pixels; infinite where nothing is.
fn error_px(tracker: &Tracker, template: &Template, truth: &Maps) -> f64 {
    tracker.current().surface.as_ref().map_or(f64::INFINITY, |surface| {
        let maps = surface.maps(template.mesh());
        let metrics = frame_metrics(&maps, truth, &surface.camera, template.size_mm()).unwrap();
        metrics.registration_rmse_px.unwrap()
    })
}

fn surface(tracker: &Tracker) -> &Surface {
    tracker.current().surface.as_ref().unwrap()
}

#[test]
fn trackers_and_their_images_may_move_between_threads() {
    fn is_send<T: Send>() {}
    is_send::<Tracker>();
    is_send::<TrackerImage>();
}

#[test]
fn images_in_the_buffers_of_forgotten_ones_are_followed_as_new_ones_are() {
    let mut video = Video::new();
    let mut trackers = [(); 2].map(|()| Tracker::new(&video.template).unwrap());
    for frame in 0..MEMORY as u64 + 5 {
        let (picture, truth) = (video.picture(frame), video.vertices(frame));
        // Both have forgotten it, and it goes to the last that says so.
        let spare = trackers.iter_mut().filter_map(Tracker::spare_image).last();
        assert_eq!(spare.is_some(), frame as usize > MEMORY, "{frame}");
        let shared = TrackerImage::of_into(&picture, spare);
        let time_s = frame as f64 * FRAME_S;
        let new = TrackerImage::of(&picture);
        video.tracker.follow(frame, time_s, &new, &video.camera).unwrap();
        video.tracker.update(frame, Some(&truth)).unwrap();
        for tracker in &mut trackers {
            tracker.follow(frame, time_s, &shared, &video.camera).unwrap();
            tracker.update(frame, Some(&truth)).unwrap();
            assert_eq!(surface(tracker), surface(&video.tracker));
        }
    }
}

/// A phone that is turned shows other frames: the old track ends, answers to the old frames count no more, and a new track starts.
#[test]
fn a_camera_that_is_turned_starts_the_video_afresh() {
    let mut video = Video::new();
    let pictures: Vec<Picture> = (0..4).map(|frame| video.picture(frame)).collect();
    video.follow(0, &pictures[0]);
    let truth = video.vertices(0);
    assert_eq!(video.tracker.update(0, Some(&truth)).unwrap(), TrackUpdate::Started);
    assert!(video.follow(1, &pictures[1]));
    let across = (video.vertices(1), video.vertices(3));
    video.camera = video.camera.turned_anticlockwise();
    let turned = |picture: &Picture| (0..3).fold(picture.clone(), |picture, _| picture.turned_clockwise());
    assert!(!video.follow(2, &turned(&pictures[2])));
    assert_eq!(video.tracker.update(1, Some(&across.0)).unwrap(), TrackUpdate::Ignored);
    assert!(!video.follow(3, &turned(&pictures[3])));
    let upright: Vec<DVec3> = across.1.iter().map(|p| DVec3::new(p.y, -p.x, p.z)).collect();
    assert_eq!(video.tracker.update(3, Some(&upright)).unwrap(), TrackUpdate::Started);
    assert_eq!(
        surface(&video.tracker).maps(video.template.mesh()).size(),
        (270, 480).into()
    );
}

/// Zoomed out, the same camera sees more: the mesh stays, and late answers are about the view in which their frame was followed.
#[test]
fn a_view_that_is_zoomed_between_frames_keeps_the_track() {
    let mut video = Video::new();
    let (near, wide) = (
        video.camera,
        Camera::pinhole((480, 270), DVec2::new(285.0, 285.0), DVec2::new(240.0, 135.0)).unwrap(),
    );
    let view_of = |frame: u64| if (3..6).contains(&frame) { wide } else { near };
    for frame in 0..9 {
        video.camera = view_of(frame);
        let picture = video.picture(frame);
        assert_eq!(video.follow(frame, &picture), frame > 0, "frame {frame}");
        if frame == 0 {
            let truth = video.vertices(0);
            assert_eq!(video.tracker.update(0, Some(&truth)).unwrap(), TrackUpdate::Started);
        }
        let error = video.error_px(frame);
        assert!(error < 0.7, "{error} px in frame {frame}");
    }
    video.camera = wide;
    let seen_wide = video.vertices(4);
    assert_eq!(
        video.tracker.update(4, Some(&seen_wide)).unwrap(),
        TrackUpdate::Confirmed
    );
    // A track that is lost comes back through frames of both views.
    let wall = Picture::from_fn(480, 270, |x, y| [if (x / 12 + y / 9) % 2 == 0 { 60 } else { 150 }; 3]);
    video.camera = near;
    for frame in 9..14 {
        video.follow(frame, &wall);
    }
    assert!(video.tracker.current().surface.is_none());
    for frame in 14..18 {
        video.camera = if frame < 16 { wide } else { near };
        let picture = video.picture(frame);
        video.follow(frame, &picture);
    }
    video.camera = wide;
    let seen_wide = video.vertices(14);
    assert_eq!(
        video.tracker.update(14, Some(&seen_wide)).unwrap(),
        TrackUpdate::Started
    );
    video.camera = near;
    let error = video.error_px(17);
    assert!(error < 0.7, "{error} px after catching up");
}

#[test]
fn a_track_starts_from_an_answer_four_frames_late_and_stays_within_a_pixel() {
    let mut video = Video::new();
    for frame in 0..5 {
        let picture = video.picture(frame);
        assert!(!video.follow(frame, &picture), "nothing has been found yet");
    }
    let answer = video.tracker.update(0, Some(&video.vertices(0))).unwrap();
    assert_eq!(answer, TrackUpdate::Started);
    for frame in 5..40 {
        let picture = video.picture(frame);
        assert!(video.follow(frame, &picture), "lost in frame {frame}");
        let error = video.error_px(frame);
        assert!(error < 0.7, "{error} px in frame {frame}");
        assert!(surface(&video.tracker).verdict.correlation > 0.8);
    }
    assert_eq!(
        video.tracker.update(36, Some(&video.vertices(36))).unwrap(),
        TrackUpdate::Confirmed
    );
    let seen = surface(&video.tracker).confidence.iter().filter(|&&c| c > 0.7).count();
    assert!(
        2 * seen > video.template.mesh().vertices().len(),
        "{seen} vertices are confirmed"
    );
}

#[test]
fn a_sheet_that_leaves_is_lost_and_an_answer_finds_it_again() {
    let mut video = Video::new();
    let picture = video.picture(0);
    video.follow(0, &picture);
    video.tracker.update(0, Some(&video.vertices(0))).unwrap();
    let wall = Picture::from_fn(480, 270, |x, y| [if (x / 12 + y / 9) % 2 == 0 { 60 } else { 150 }; 3]);
    assert!(video.follow(1, &wall), "one frame without it is not the end");
    for frame in 2..5 {
        video.follow(frame, &wall);
    }
    assert!(video.tracker.current().surface.is_none());
    assert_eq!(video.tracker.update(4, None).unwrap(), TrackUpdate::Ignored);
    // An answer on a frame that does not show it starts nothing.
    assert_eq!(
        video.tracker.update(4, Some(&video.vertices(4))).unwrap(),
        TrackUpdate::Ignored
    );
    let picture = video.picture(5);
    video.follow(5, &picture);
    assert_eq!(
        video.tracker.update(5, Some(&video.vertices(5))).unwrap(),
        TrackUpdate::Started
    );
    assert!(video.error_px(5) < 1.0);
}

#[test]
fn a_track_ends_after_so_many_seconds_whatever_the_frame_rate() {
    let noise = |x: usize, y: usize| (x * 7919 + y * 104_729) % 251;
    let covered = TrackerImage::of(&Picture::from_fn(480, 270, |x, y| [noise(x / 3, y / 3) as u8; 3]));
    // Misses that the track survives: 0.09 s, and one in any case.
    for (frame_s, survived) in [(1.0 / 60.0, 5), (1.0 / 30.0, 2), (1.0 / 10.0, 1)] {
        let mut video = Video::new();
        let picture = video.picture(0);
        assert!(!video.follow(0, &picture));
        video.tracker.update(0, Some(&video.vertices(0))).unwrap();
        let mut found = Vec::new();
        while found.last() != Some(&false) {
            let frame = found.len() as u64 + 1;
            let time_s = frame as f64 * frame_s;
            let tracked = video.tracker.follow(frame, time_s, &covered, &video.camera).unwrap();
            assert_eq!(tracked.held, tracked.surface.is_some());
            found.push(tracked.surface.is_some());
        }
        assert_eq!(found.len() - 1, survived, "at {frame_s} s a frame");
    }
}

#[test]
fn a_sheet_that_comes_in_fast_is_followed_from_a_late_answer() {
    // 30 to 39 pixels a frame: no speed is known yet, and the widest blur reaches a third of that.
    let speeds = [34.0, 36.0, 38.0, 40.0, 42.0, 44.0];
    let started = speeds.map(|speed| {
        let Video {
            template,
            camera,
            mut tracker,
        } = Video::new();
        let vertices = |frame: u64| {
            let aside = DVec3::X * (speed * (frame as f64 - 4.0) - 20.0);
            bent(&template, 0.0).iter().map(|p| p + aside).collect::<Vec<_>>()
        };
        let truth = |frame: u64| VisibleSurface::new(template.mesh(), &vertices(frame), &camera).maps();
        for frame in 0..5 {
            let picture = TrackerImage::of(&image(&template, &truth(frame)));
            let time_s = frame as f64 * FRAME_S;
            tracker.follow(frame, time_s, &picture, &camera).unwrap();
        }
        let is_started = tracker.update(0, Some(&vertices(0))).unwrap() == TrackUpdate::Started;
        if is_started {
            // A search finds the place, not every bend: half of a frame's way at most.
            let error = error_px(&tracker, &template, &truth(4));
            assert!(error < 15.0, "{speed}: {error} px");
        }
        tracker.update(4, Some(&vertices(4))).unwrap();
        let error = error_px(&tracker, &template, &truth(4));
        assert!(error < 1.0, "{speed}: {error} px");
        is_started
    });
    // By rounding now and then one that is half out of the image is not.
    assert!(started.iter().filter(|started| **started).count() >= 4, "{started:?}");
}

/// Farther than the widest blur of a fit reaches, to either side, while the light goes off.
#[test]
fn a_sheet_that_jumped_by_fifty_pixels_is_found_in_other_light() {
    // Some 47 and 21 pixels.
    for jump in [DVec3::new(54.0, -24.0, 0.0), DVec3::new(-54.0, 24.0, 0.0)] {
        let mut video = Video::new();
        let (picture, vertices) = (video.picture(0), video.vertices(0));
        video.follow(0, &picture);
        video.tracker.update(0, Some(&vertices)).unwrap();
        let jumped: Vec<DVec3> = vertices.iter().map(|p| p + jump).collect();
        let truth = VisibleSurface::new(video.template.mesh(), &jumped, &video.camera).maps();
        let bright = image(&video.template, &truth);
        let dim = Picture::from_fn(480, 270, |x, y| bright.pixel(x, y).map(|value| 20 + value / 2));
        assert!(video.follow(1, &dim), "{jump}");
        // A search finds the place, not every bend: as near as the widest blur reaches.
        let error = error_px(&video.tracker, &video.template, &truth);
        assert!(error < 12.0, "{error} px after {jump}");
    }
}

#[test]
fn what_a_search_has_found_is_dropped_when_the_network_does_not_see_it_there() {
    let Video {
        template,
        camera,
        mut tracker,
    } = Video::new();
    let show = |frame: u64, shift_mm: f64, tracker: &mut Tracker| {
        let mut vertices = bent(&template, 0.0);
        vertices.iter_mut().for_each(|p| p.x += shift_mm);
        let truth = VisibleSurface::new(template.mesh(), &vertices, &camera).maps();
        let picture = TrackerImage::of(&image(&template, &truth));
        tracker
            .follow(frame, frame as f64 * FRAME_S, &picture, &camera)
            .unwrap();
        vertices
    };
    let truth = show(0, 0.0, &mut tracker);
    tracker.update(0, Some(&truth)).unwrap();
    show(1, 1.0, &mut tracker);
    assert!(surface(&tracker).verdict.correlation > 0.8);
    // The image shows it clearly: the network has overlooked it.
    assert_eq!(tracker.update(1, None).unwrap(), TrackUpdate::Confirmed);
    // 60 mm are some 50 pixels: only a search finds it again.
    show(2, 61.0, &mut tracker);
    assert!(surface(&tracker).verdict.correlation > 0.5);
    assert_eq!(
        tracker.update(1, None).unwrap(),
        TrackUpdate::Confirmed,
        "that was before the search"
    );
    // An answer that shows too little changes nothing, and so the doubt stays.
    let behind = vec![-DVec3::Z; template.mesh().vertices().len()];
    assert_eq!(tracker.update(2, Some(&behind)).unwrap(), TrackUpdate::Ignored);
    assert_eq!(tracker.update(2, None).unwrap(), TrackUpdate::Dropped);
    assert!(tracker.current().surface.is_none());
}

#[test]
fn after_a_jump_the_next_answer_puts_the_track_right() {
    let mut video = Video::new();
    let picture = video.picture(0);
    video.follow(0, &picture);
    video.tracker.update(0, Some(&video.vertices(0))).unwrap();
    // The sheet of another time: elsewhere, and bent more.
    let jumped = video.picture(12);
    video.follow(1, &jumped);
    let found = video.tracker.update(1, Some(&video.vertices(12))).unwrap();
    assert!(
        matches!(
            found,
            TrackUpdate::Restarted | TrackUpdate::Started | TrackUpdate::Confirmed
        ),
        "{found:?}"
    );
    let error = video.error_px(12);
    assert!(error < 1.0, "{found:?}, {error} px");
}

#[test]
fn a_sheet_that_rushes_at_the_camera_and_is_predicted_behind_it_is_no_error() {
    let mut video = Video::new();
    let truths = [1.0, 0.6]
        .map(|fraction| -> Vec<DVec3> { bent(&video.template, 0.0).into_iter().map(|p| p * fraction).collect() });
    let picture_of = |vertices: &[DVec3], video: &Video| {
        let truth = VisibleSurface::new(video.template.mesh(), vertices, &video.camera).maps();
        image(&video.template, &truth)
    };
    for (frame, truth) in truths.iter().enumerate() {
        let picture = picture_of(truth, &video);
        video.follow(frame as u64, &picture);
        video.tracker.update(frame as u64, Some(truth)).unwrap();
    }
    // After a pause twice as long as the step before, it would be a tenth of a metre behind the camera.
    let picture = picture_of(&truths[0], &video);
    for frame in 3..8 {
        video.follow(frame, &picture);
    }
    let answer = video.tracker.update(7, Some(&truths[0])).unwrap();
    assert!(video.tracker.current().surface.is_some(), "{answer:?}");
}

#[test]
fn a_forgotten_frame_is_ignored_and_wrong_sizes_are_refused() {
    let mut video = Video::new();
    assert_eq!(
        video.tracker.update(0, None).unwrap(),
        TrackUpdate::Ignored,
        "no frame yet"
    );
    let picture = video.picture(0);
    video.follow(7, &picture);
    assert_eq!(
        video.tracker.update(3, Some(&video.vertices(0))).unwrap(),
        TrackUpdate::Ignored
    );
    assert!(matches!(
        video.tracker.update(7, Some(&[DVec3::Z; 3])),
        Err(GeometryError::StartLength { actual: 3, .. })
    ));
    let little = TrackerImage::of(&Picture::from_fn(48, 27, |_, _| [0; 3]));
    let refused = video.tracker.follow(8, 1.0, &little, &video.camera);
    assert!(matches!(refused, Err(GeometryError::MapSize { .. })));
}
