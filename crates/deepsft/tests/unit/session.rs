//! How targets of a video are found, followed and lost, natively and in the browser.

use crate::finding::print;
use crate::near::{bent, photograph};
use deepsft::session::{
    Answer, Followed, FollowedFrame, Session, SessionOptions, Source, TargetId, VideoFollower, VideoOptions,
};
use deepsft::{Target, TargetFinder, View};
use deepsft_geometry::glam::DVec3;
use deepsft_geometry::tracking::{OneEuroOptions, TrackUpdate};
use deepsft_geometry::{Camera, Picture, Template, training_camera};

const FRAME_S: f64 = 1.0 / 30.0;
const SHEET: TargetId = 3;

/// A session that follows a printed sheet, which lies before the camera or is covered.
struct Video {
    session: Session,
    template: Template,
    source: Source,
    frame: u64,
}

impl Video {
    fn new(options: SessionOptions) -> Self {
        let template = Template::thin_shell(print(), 297.0, 210.0).unwrap();
        let mut session = Session::new(options);
        session.add(SHEET, &template, training_camera(), false).unwrap();
        Self {
            session,
            template,
            source: training_camera().into(),
            frame: 0,
        }
    }

    fn time_s(&self) -> f64 {
        self.frame as f64 * FRAME_S
    }

    /// Whom the session asks about, after a frame that was looked at, and asks if it does.
    fn look(&mut self, picture: &Picture) -> (FollowedFrame, Vec<TargetId>) {
        let (now_s, Source { camera, .. }) = (self.time_s(), self.source);
        let next = self.session.next(&camera, now_s);
        let asked = next
            .question
            .as_ref()
            .map_or(Vec::new(), |question| question.targets.clone());
        if let Some(question) = next.question {
            self.session.ask(question, now_s);
        }
        self.frame += 1;
        let mut image = View::new(picture, &camera);
        let frame = self.session.frame(now_s, &self.source, &next.view, &mut image).unwrap();
        (frame, asked)
    }

    fn sees(&mut self, picture: &Picture) -> Followed {
        let mut targets = self.look(picture).0.targets;
        assert_eq!(targets.len(), 1);
        targets.remove(0)
    }

    fn answer(&mut self, target: TargetId, starts: Vec<Vec<DVec3>>) -> TrackUpdate {
        let effects = self
            .session
            .answer(&[Answer { target, starts }], self.time_s(), FRAME_S, f64::INFINITY)
            .unwrap();
        effects.first().map_or(TrackUpdate::Ignored, |effect| effect.update)
    }

    /// The sheet at a distance, in its image and as finders see it.
    fn sheet(&self, depth_mm: f64) -> (Picture, Vec<DVec3>) {
        let vertices = bent(&self.template, depth_mm);
        (photograph(&self.template, &vertices, &self.source.camera), vertices)
    }

    /// The sheet is found in its first frame, by an answer about that frame.
    fn begin(&mut self) -> Picture {
        let (picture, seen) = self.sheet(480.0);
        assert!(!self.sees(&picture).found);
        assert_eq!(self.answer(SHEET, vec![seen]), TrackUpdate::Started);
        picture
    }
}

/// Nothing that looks like a print.
fn noise() -> Picture {
    let value = |x: usize, y: usize| (x / 3 * 7919 + y / 3 * 104_729) % 251;
    Picture::from_fn(480, 270, |x, y| [value(x, y) as u8; 3])
}

#[test]
fn a_missing_target_is_asked_for_in_one_question_at_a_time() {
    let mut video = Video::new(SessionOptions::default());
    let noise = noise();
    let asked = |video: &mut Video| video.look(&noise).1;
    assert_eq!(asked(&mut video), [SHEET]);
    assert!(asked(&mut video).is_empty());
    assert_eq!(video.answer(SHEET, Vec::new()), TrackUpdate::Ignored);
    assert_eq!(asked(&mut video), [SHEET]);
}

#[test]
fn frames_come_no_faster_than_the_trackers_remember_them_until_an_answer_and_a_very_late_one_does_not_stop_the_video() {
    let mut video = Video::new(SessionOptions::default());
    // The trackers remember 32 frames, and three quarters of them are counted on.
    for (took_s, interval_s) in [(0.0, 0.06), (2.4, 0.1), (6.0, 0.25), (60.0, 0.25)] {
        let camera = video.source.camera;
        let question = video.session.next(&camera, 100.0).question.unwrap();
        video.session.ask(question, 100.0);
        let answered = video.session.answer(&[], 100.0 + took_s, took_s, f64::INFINITY);
        assert!(answered.unwrap().is_empty());
        let next = video.session.next(&camera, 200.0);
        assert!((next.interval_s - interval_s).abs() < 1e-12, "{took_s}: {next:?}");
    }
}

#[test]
fn a_question_that_is_withdrawn_is_asked_again_and_its_answer_is_not_heard() {
    let mut video = Video::new(SessionOptions::default());
    let (picture, seen) = video.sheet(480.0);
    assert_eq!(video.look(&picture).1, [SHEET]);
    assert!(video.look(&picture).1.is_empty());
    video.session.withdraw();
    assert_eq!(video.answer(SHEET, vec![seen.clone()]), TrackUpdate::Ignored);
    assert_eq!(video.look(&picture).1, [SHEET]);
    assert_eq!(video.answer(SHEET, vec![seen]), TrackUpdate::Started);
}

#[test]
fn a_video_that_waits_asks_about_every_so_many_frames_but_no_second_question_before_the_answer() {
    let options = SessionOptions {
        ask_every: Some(3),
        ..SessionOptions::default()
    };
    let mut video = Video::new(options);
    let picture = video.begin();
    let asked: Vec<bool> = (1..8)
        .map(|_| {
            let is_asked = !video.look(&picture).1.is_empty();
            video.answer(SHEET, Vec::new());
            is_asked
        })
        .collect();
    assert_eq!(asked, [false, false, true, false, false, true, false]);
    let asked: Vec<bool> = (8..16).map(|_| !video.look(&picture).1.is_empty()).collect();
    assert_eq!(asked, [false, true, false, false, false, false, false, false]);
}

#[test]
fn a_target_is_found_by_a_strong_answer_held_while_it_is_covered_and_lost_after_0_4_seconds() {
    let mut video = Video::new(SessionOptions::default());
    let picture = video.begin();
    // The frame that was asked about knows it now; the change is told once.
    let found = video.session.followed();
    assert!(found[0].found && found[0].changed);
    assert!(found[0].correlation >= 0.8 && !found[0].held);
    let sheet = video.sees(&picture);
    assert_eq!((sheet.found, sheet.changed, sheet.held), (true, false, false));
    let noise = noise();
    let mut covered: Vec<Followed> = (0..11).map(|_| video.sees(&noise)).collect();
    for held in &covered {
        assert!(held.found && held.held && !held.changed, "{held:?}");
        let vertices = |seen: &Followed| seen.surface.as_ref().map(|surface| surface.vertices_camera.clone());
        assert_eq!(vertices(held), vertices(&sheet));
    }
    // The tracker gave up at 0.1 seconds: from then on finders look for it.
    assert_eq!(covered.remove(10).correlation, 0.0);
    let lost = video.sees(&noise);
    assert!(!lost.found && lost.changed && lost.surface.is_none());
    assert!(!video.sees(&noise).changed);
}

#[test]
fn a_sheet_that_is_followed_well_is_confirmed_every_two_seconds() {
    let mut video = Video::new(SessionOptions::default());
    let picture = video.begin();
    let asked: Vec<usize> = (1..70).filter(|_| !video.look(&picture).1.is_empty()).collect();
    assert_eq!(asked, [60]);
}

#[test]
fn another_video_begins_without_what_was_found_and_without_late_answers() {
    let mut video = Video::new(SessionOptions::default());
    let picture = video.begin();
    let (frame, _) = video.look(&picture);
    assert!(frame.targets[0].found && !frame.afresh && frame.number == 1);
    video.session.restart();
    let (frame, asked) = video.look(&picture);
    assert!(frame.afresh && !frame.targets[0].found && frame.targets[0].changed);
    assert_eq!(asked, [SHEET]);
    // An answer about the video before starts nothing, though the new one shows the same.
    let seen = video.sheet(480.0).1;
    video.session.restart();
    assert!(video.look(&picture).1.is_empty());
    assert_eq!(video.answer(SHEET, vec![seen]), TrackUpdate::Ignored);
    assert_eq!(video.look(&picture).1, [SHEET]);
    // The same of a camera that is turned, and of a time that does not ascend.
    video.source = training_camera()
        .resized((480, 270))
        .unwrap()
        .turned_anticlockwise()
        .into();
    let (frame, asked) = video.look(&Picture::from_fn(270, 480, |_, _| [90; 3]));
    assert!(frame.afresh && asked.is_empty());
    video.frame = 0;
    assert!(video.look(&Picture::from_fn(270, 480, |_, _| [90; 3])).0.afresh);
}

#[test]
fn a_rest_of_the_finders_ends_when_the_target_is_removed_that_they_rest_for() {
    const OTHER: TargetId = 5;
    let mut video = Video::new(SessionOptions::default());
    let other = Template::thin_shell(noise(), 297.0, 167.0).unwrap();
    video.session.add(OTHER, &other, training_camera(), false).unwrap();
    let (picture, seen) = video.sheet(480.0);
    video.look(&picture);
    let starts = vec![seen];
    let answer = Answer { target: SHEET, starts };
    // A frame was missed meanwhile: they rest for 1.2 times the second that the answer took.
    video.session.answer(&[answer], 1.0, 1.0, 0.0).unwrap();
    video.frame = 31;
    assert!(video.look(&picture).1.is_empty());
    video.session.remove(SHEET);
    assert_eq!(video.look(&picture).1, [OTHER]);
}

/// The tracker follows the frame that was asked about meanwhile, and more: that tells nothing of the device.
#[test]
fn searches_of_8_ms_do_not_slow_down_where_their_answers_come_40_ms_after_their_frames() {
    const OTHER: TargetId = 5;
    let mut video = Video::new(SessionOptions::default());
    let other = Template::thin_shell(noise(), 297.0, 167.0).unwrap();
    video.session.add(OTHER, &other, training_camera(), false).unwrap();
    let (picture, seen) = video.sheet(480.0);
    video.look(&picture);
    assert_eq!(video.answer(SHEET, vec![seen]), TrackUpdate::Started);
    for late_s in [0.008, 0.04, 0.04, 0.04, 0.04] {
        let asked_s = video.time_s();
        assert_eq!(video.look(&picture).1, [OTHER], "at {asked_s} s");
        let answered = video.session.answer(&[], asked_s + late_s, 0.008, f64::INFINITY);
        assert!(answered.unwrap().is_empty());
        // Every second frame.
        video.frame += 1;
    }
}

/// Where a question that was asked about the first frame of another view was forgotten, a third target was never looked for.
#[test]
fn missing_targets_keep_their_turns_while_someone_turns_the_camera() {
    let mut video = Video::new(SessionOptions::default());
    for id in [5, 7] {
        let other = Template::thin_shell(noise(), 297.0, 167.0).unwrap();
        video.session.add(id, &other, training_camera(), false).unwrap();
    }
    let [level, upright] = [noise(), Picture::from_fn(270, 480, |_, _| [90; 3])];
    let camera = training_camera().resized((480, 270)).unwrap();
    let mut asked = |is_turned: bool| {
        let (camera, picture) = match is_turned {
            true => (camera.turned_anticlockwise(), &upright),
            false => (camera, &level),
        };
        video.source = camera.into();
        let (frame, asked) = video.look(picture);
        // So slow that one at a time is enough.
        video.frame += 26;
        let answered = video.session.answer(&[], video.time_s(), 0.9, f64::INFINITY);
        assert!(answered.unwrap().is_empty());
        (frame.afresh, asked)
    };
    assert_eq!(asked(false), (true, vec![SHEET, 5, 7]));
    assert_eq!(asked(false), (false, vec![SHEET]));
    let turned = [true, false, false, true, false].map(&mut asked);
    let expected = [(true, 5), (true, 7), (false, SHEET), (true, 5), (true, 7)];
    assert_eq!(turned, expected.map(|(afresh, id)| (afresh, vec![id])));
}

#[test]
fn a_video_that_waits_for_its_finders_tells_each_change_once() {
    let target = Target::from_picture(print(), 297.0).unwrap();
    let camera = training_camera();
    let picture = photograph(target.template(), &bent(target.template(), 480.0), &camera);
    let mut finder = TargetFinder::new(target).unwrap();
    let options = VideoOptions {
        session: SessionOptions {
            ask_every: Some(1),
            ..SessionOptions::default()
        },
        delay: 0,
        ..VideoOptions::default()
    };
    let mut follower = VideoFollower::new(&mut finder, options, || 0.0).unwrap();
    let mut follow = |picture: &Picture, frame: u32| {
        let time_s = f64::from(frame) * FRAME_S;
        let followed = pollster::block_on(follower.follow(time_s, &mut View::new(picture, &camera))).unwrap();
        (followed.followed.found, followed.followed.changed)
    };
    // The last frame begins another video, in which it is lost, and found by the answer about the same frame.
    let told = [0, 1, 2, 0].map(|frame| follow(&picture, frame));
    assert_eq!(told, [(true, true), (true, false), (true, false), (true, false)]);
    let covered: Vec<_> = (1..20).map(|frame| follow(&noise(), frame)).collect();
    assert_eq!(covered.iter().filter(|(_, changed)| *changed).count(), 1, "{covered:?}");
    assert!(!covered[18].0);
}

#[test]
fn where_what_was_seen_started_nothing_the_next_look_is_into_the_widest_view() {
    let mut video = Video::new(SessionOptions::default());
    video.source = Camera::typical((640, 480)).unwrap().into();
    let picture = Picture::from_fn(640, 480, |x, y| [((x / 3) * (y / 3) % 251) as u8; 3]);
    let mut views = Vec::new();
    for _ in 0..3 {
        views.push(video.session.next(&video.source.camera, video.time_s()).view.focal().x);
        video.look(&picture);
        let seen = vec![-DVec3::Z; video.template.mesh().vertices().len()];
        assert_eq!(video.answer(SHEET, vec![seen]), TrackUpdate::Ignored);
    }
    assert!(views[0] == 380.0 && views[1] < 300.0 && views[2] == 380.0, "{views:?}");
}

#[test]
fn two_sheets_are_followed_in_one_video_until_one_is_removed() {
    const OTHER: TargetId = 5;
    let mut video = Video::new(SessionOptions::default());
    let art = Picture::from_fn(60, 40, |x, y| [(x * y % 251) as u8, (4 * x) as u8, (6 * y) as u8]);
    let other = Template::thin_shell(art, 297.0, 198.0).unwrap();
    video.session.add(OTHER, &other, training_camera(), false).unwrap();
    let (picture, seen) = video.sheet(480.0);
    assert_eq!(video.look(&picture).1, [SHEET, OTHER]);
    assert_eq!(video.answer(SHEET, vec![seen]), TrackUpdate::Started);
    let (frame, asked) = video.look(&picture);
    let found: Vec<_> = frame.targets.iter().map(|one| (one.target, one.found)).collect();
    assert_eq!((found, asked), (vec![(SHEET, true), (OTHER, false)], vec![OTHER]));
    video.session.remove(OTHER);
    assert_eq!(video.answer(OTHER, Vec::new()), TrackUpdate::Ignored);
    assert_eq!(video.look(&picture).0.targets.len(), 1);
}

/// Where the smoothed meshes lagged, they and the images told of another camera.
#[test]
fn smoothing_is_for_who_looks_and_changes_nothing_of_what_the_meshes_tell_of_the_camera() {
    let follow = |smoothing: Option<OneEuroOptions>| {
        let mut video = Video::new(SessionOptions {
            smoothing,
            ..SessionOptions::default()
        });
        video.source.focal_deviation = f64::INFINITY;
        video.begin();
        let mut meshes: Vec<Vec<DVec3>> = Vec::new();
        for frame in 0..16 {
            // 12 mm a frame.
            let (picture, _) = video.sheet(480.0 + 12.0 * f64::from(frame));
            meshes.push(video.sees(&picture).surface.unwrap().vertices_camera);
        }
        let found = video.session.solve_camera(SHEET, 30).unwrap();
        (meshes, found, video.session.maps(SHEET).unwrap().1)
    };
    let (fitted, found, maps) = follow(None);
    let slow = OneEuroOptions {
        speed_coefficient: 0.0,
        ..OneEuroOptions::default()
    };
    let (smooth, found_too, same_maps) = follow(Some(slow));
    let lag = fitted[15][0].distance(smooth[15][0]);
    assert!(lag > 5.0 && found.is_some(), "{lag} mm, {found:?}");
    assert_eq!(found_too, found);
    assert!(same_maps == maps);
}
