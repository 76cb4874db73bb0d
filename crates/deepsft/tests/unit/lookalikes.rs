//! Targets that resemble each other, and two copies of one print.

use crate::finding::print;
use crate::near::{bent, photograph};
use deepsft::session::{Answer, Effect, Followed, FollowedFrame, Session, SessionOptions, VideoFollower, VideoOptions};
use deepsft::{Target, TargetFinder, View};
use deepsft_geometry::glam::DVec3;
use deepsft_geometry::tracking::TrackUpdate;
use deepsft_geometry::{Camera, Picture, Template, training_camera};
use std::collections::BTreeSet;

/// A card of a series: the frame of all of them around a picture of its own.
fn card(number: usize) -> Template {
    let all = print();
    let own = Picture::from_fn(594, 420, |x, y| {
        let (column, row) = ((x + 97 * number) % 594, (y + 211 * number) % 420);
        all.pixel(593 - column, row)
    });
    let is_frame = |x: usize, y: usize| !(120..474).contains(&x) || !(80..340).contains(&y);
    let picture = Picture::from_fn(594, 420, |x, y| match is_frame(x, y) {
        true => all.pixel(x, y),
        false => own.pixel(x, y),
    });
    Template::thin_shell(picture, 297.0, 210.0).unwrap()
}

fn finder(template: &Template) -> TargetFinder {
    TargetFinder::new(Target::from_template(template.clone())).unwrap()
}

/// Whether it is found in the image, and whether a track may start.
fn sees(finder: &mut TargetFinder, picture: &Picture) -> [bool; 2] {
    let camera = training_camera();
    let mut view = View::new(picture, &camera);
    let estimate = pollster::block_on(finder.estimate(&mut view)).unwrap();
    let (sightings, _) = pollster::block_on(finder.find(&mut view, &camera)).unwrap();
    [estimate.judgement.found, !sightings.is_empty()]
}

#[test]
fn of_two_cards_of_a_series_the_one_that_is_shown_is_found_and_the_other_in_its_place_is_not() {
    let cards = [card(1), card(2)];
    let mut finders = cards.each_ref().map(finder);
    let picture = photograph(&cards[0], &bent(&cards[0], 480.0), &training_camera());
    let alone = finders.each_mut().map(|finder| sees(finder, &picture));
    assert_eq!(alone, [[true; 2]; 2], "the frame is enough for each by itself");
    let [first, second] = &mut finders;
    let share = first.tell_apart(second);
    // The frame is 63 % of the card.
    assert!((0.4..0.8).contains(&share), "{share}");
    assert_eq!([sees(first, &picture), sees(second, &picture)], [[true; 2], [false; 2]]);
    // In print twice as large the other looks the same from twice as far.
    let texture = cards[1].texture();
    let large = Template::thin_shell(texture.clone(), 594.0, 420.0).unwrap();
    let mut large = finder(&large);
    assert_eq!(sees(&mut large, &picture), [true; 2]);
    assert!(first.tell_apart(&mut large) > 0.4);
    assert_eq!(
        [sees(first, &picture), sees(&mut large, &picture)],
        [[true; 2], [false; 2]]
    );
    // A target that is gone takes nothing away.
    let _ = std::mem::replace(first, finder(&cards[0]));
    assert_eq!(sees(&mut large, &picture), [true; 2]);
}

#[test]
fn a_card_whose_frame_alone_is_confirmed_gives_way_to_the_one_that_fits_from_there() {
    let cards = [card(1), card(2)];
    let [mut first, mut second] = cards.each_ref().map(finder);
    let (camera, shape) = (training_camera(), bent(&cards[0], 480.0));
    let picture = photograph(&cards[0], &shape, &camera);
    let mut view = View::new(&picture, &camera);
    let found = pollster::block_on(second.estimate(&mut view)).unwrap();
    // Inside the frame the mesh lies beside what is printed there, which then confirms neither card.
    let mut surface = found.surface.unwrap();
    let rest = cards[0].mesh().vertices().iter().zip(&shape);
    let moved = rest.map(|(rest, p)| match rest.x.abs() < 100.0 && rest.y.abs() < 76.0 {
        true => *p + DVec3::new(9.0, -7.0, 0.0),
        false => *p,
    });
    surface.vertices_camera = moved.collect();
    surface.camera = camera;
    surface.verdict.explained = 0.7;
    first.tell_apart(&mut second);
    assert!(second.is_outdone(&mut view, &surface).unwrap());
    surface.vertices_camera = shape;
    assert!(!first.is_outdone(&mut view, &surface).unwrap());
}

#[test]
fn prints_that_have_nothing_in_common_share_no_corners() {
    let print = print();
    let other = Picture::from_fn(594, 420, |x, y| print.pixel(593 - x, 419 - y));
    let other = Template::thin_shell(other, 297.0, 210.0).unwrap();
    let share = finder(&card(1)).tell_apart(&mut finder(&other));
    assert!(share < 0.05, "{share}");
}

#[test]
fn a_drawing_that_was_coloured_in_is_found_as_its_template() {
    let cell = |x: usize, y: usize| {
        let nearest = |k: usize| {
            let at = [(k * 7919 + 13) % 594, (k * 104_729 + 57) % 420];
            at[0].abs_diff(x).pow(2) + at[1].abs_diff(y).pow(2)
        };
        (0..60).min_by_key(|&k| nearest(k)).unwrap()
    };
    let cells: Vec<usize> = (0..594 * 420).map(|pixel| cell(pixel % 594, pixel / 594)).collect();
    let at = |x: usize, y: usize| cells[594 * y.min(419) + x.min(593)];
    let drawn = |is_coloured: bool| {
        let picture = Picture::from_fn(594, 420, |x, y| match at(x, y) {
            own if own != at(x + 4, y) || own != at(x, y + 4) => [15; 3],
            own if is_coloured => [90 + own * 53 % 160, 90 + own * 91 % 160, 90 + own * 37 % 160].map(|c| c as u8),
            _ => [245; 3],
        });
        Template::thin_shell(picture, 297.0, 210.0).unwrap()
    };
    let [plain, coloured] = [false, true].map(drawn);
    let photographs = [&plain, &coloured].map(|of| photograph(of, &bent(of, 480.0), &training_camera()));
    let mut finders = [finder(&plain), finder(&coloured)];
    assert_eq!(sees(&mut finders[0], &photographs[1]), [true; 2]);
    // Where both are looked for the better one is found.
    let [first, second] = &mut finders;
    assert!(first.tell_apart(second) > 0.3);
    for (picture, expected) in photographs.iter().zip([[true, false], [false, true]]) {
        let seen = [&mut *first, &mut *second].map(|finder| sees(finder, picture)[0]);
        assert_eq!(seen, expected);
    }
}

/// A session that follows two prints.
struct Video {
    session: Session,
    frame: u32,
}

impl Video {
    fn new(templates: &[Template]) -> Self {
        let mut session = Session::new(SessionOptions::default());
        for (id, template) in (0..).zip(templates) {
            session.add(id, template, training_camera(), false).unwrap();
        }
        Self { session, frame: 0 }
    }

    /// Follows a frame; the finders that are asked about it answer at once with `starts`, where there are some.
    fn look(&mut self, picture: &Picture, starts: &[(u32, &[DVec3])]) -> (FollowedFrame, Vec<Effect>) {
        let (camera, now_s) = (training_camera(), f64::from(self.frame) / 30.0);
        self.frame += 1;
        let next = self.session.next(&camera, now_s);
        if let (Some(question), false) = (next.question, starts.is_empty()) {
            self.session.ask(question, now_s);
        }
        let mut view = View::new(picture, &camera);
        let frame = self
            .session
            .frame(now_s, &camera.into(), &next.view, &mut view)
            .unwrap();
        let answer = |&(target, start): &(u32, &[DVec3])| Answer {
            target,
            starts: vec![start.to_vec()],
        };
        let answers: Vec<_> = starts.iter().map(answer).collect();
        let effects = self.session.answer(&answers, now_s, 0.03, f64::INFINITY).unwrap();
        (frame, effects)
    }

    fn found(&mut self) -> Vec<bool> {
        self.session.followed().iter().map(|target| target.found).collect()
    }
}

#[test]
fn of_two_cards_in_one_place_of_a_video_the_better_one_is_followed_also_after_they_are_exchanged() {
    let cards = [card(1), card(2)];
    let place = bent(&cards[0], 480.0);
    let pictures = cards
        .each_ref()
        .map(|card| photograph(card, &place, &training_camera()));
    let mut video = Video::new(&cards);
    let starts = [(0, &place[..]), (1, &place[..])];
    let (_, effects) = video.look(&pictures[0], &starts);
    assert!(
        effects.iter().all(|effect| effect.update == TrackUpdate::Started),
        "{effects:?}"
    );
    assert_eq!(video.found(), [true, false]);
    for _ in 0..3 {
        video.look(&pictures[0], &[]);
        assert_eq!(video.found(), [true, false]);
    }
    // The frame of the other card holds the track until finders see that one.
    video.look(&pictures[1], &[]);
    assert_eq!(video.found(), [true, false]);
    video.look(&pictures[1], &starts[1..]);
    assert_eq!(video.found(), [false, true]);
}

/// Two sheets at either side of the view, the first of them spoilt by noise.
fn two_copies(template: &Template) -> (Picture, [Vec<DVec3>; 2]) {
    let camera: Camera = training_camera();
    let places = [-150.0, 150.0].map(|x| {
        bent(template, 750.0)
            .iter()
            .map(|p| p + DVec3::X * x)
            .collect::<Vec<_>>()
    });
    let seen = places.each_ref().map(|place| photograph(template, place, &camera));
    let picture = Picture::from_fn(480, 270, |x, y| match x < 240 {
        true => seen[0]
            .pixel(x, y)
            .map(|c| (c / 2).saturating_add(((x * 7919 + y * 104_729) % 97) as u8)),
        false => seen[1].pixel(x, y),
    });
    (picture, places)
}

#[test]
fn of_two_copies_of_a_print_the_followed_one_is_kept_though_the_other_is_seen_better() {
    let template = Template::thin_shell(print(), 297.0, 210.0).unwrap();
    let (picture, places) = two_copies(&template);
    let mut video = Video::new(&[template]);
    video.look(&picture, &[(0, &places[0])]);
    let mut sees = |start: &[(u32, &[DVec3])]| {
        let (_, effects) = video.look(&picture, start);
        let followed = video.session.followed().remove(0);
        let vertices = followed.surface.unwrap().vertices_camera;
        let middle = vertices.iter().sum::<DVec3>() / vertices.len() as f64;
        (middle.x < 0.0, followed.correlation, effects)
    };
    let (is_first, correlation, _) = sees(&[]);
    assert!(is_first && (0.6..0.9).contains(&correlation), "{correlation}");
    // After two seconds the finders are asked to confirm it, and see the other copy.
    let mut asked = 0;
    for _ in 0..70 {
        let (is_first, _, effects) = sees(&[(0, &places[1])]);
        asked += effects.len();
        assert!(is_first, "{effects:?}");
    }
    assert!(asked > 0);
}

fn middle(vertices: &[DVec3]) -> DVec3 {
    vertices.iter().sum::<DVec3>() / vertices.len() as f64
}

#[test]
fn up_to_as_many_copies_as_are_asked_for_are_followed_each_in_its_own_place() {
    let template = Template::thin_shell(print(), 297.0, 210.0).unwrap();
    let (picture, places) = two_copies(&template);
    let mut video = Video::new(std::slice::from_ref(&template));
    video.session.add_copy(7, 0).unwrap();
    let mut look = |picture: &Picture, starts: &[usize]| {
        let (camera, now_s) = (training_camera(), f64::from(video.frame) / 30.0);
        video.frame += 1;
        let next = video.session.next(&camera, now_s);
        // One question about all copies of a print.
        let asked = next.question.map(|question| {
            assert_eq!(question.targets, [0]);
            video.session.ask(question, now_s);
        });
        let mut view = View::new(picture, &camera);
        video
            .session
            .frame(now_s, &camera.into(), &next.view, &mut view)
            .unwrap();
        let starts = starts.iter().map(|k| places[*k].clone()).collect();
        let answer = Answer { target: 0, starts };
        let effects = video.session.answer(&[answer], now_s, 0.03, f64::INFINITY).unwrap();
        let sides = video.session.followed();
        let side = |followed: &Followed| {
            followed
                .surface
                .as_ref()
                .map(|surface| middle(&surface.vertices_camera).x > 0.0)
        };
        (sides.iter().map(side).collect::<Vec<_>>(), effects, asked.is_some())
    };
    // The first copy is seen twice, by two finders; then both, the other first. Three frames confirm what is spoilt.
    let (_, effects, _) = look(&picture, &[0, 0]);
    assert_eq!(effects.len(), 1);
    let confirmed = (0..2).map(|_| look(&picture, &[0, 0]).0).last();
    assert_eq!(confirmed, Some(vec![Some(false), None]));
    let (sides, effects, _) = look(&picture, &[1, 0]);
    assert_eq!(sides, [Some(false), Some(true)], "{effects:?}");
    // After two seconds the finders are asked to confirm them: they see both, or one.
    let mut asked = 0;
    for frame in 0..140 {
        let (sides, _, was_asked) = look(&picture, [&[1, 0][..], &[1]][frame % 2]);
        assert_eq!(sides, [Some(false), Some(true)], "frame {frame}");
        asked += usize::from(was_asked);
    }
    assert!(asked > 1);
    // The first is covered: lost, and found again where it was, while the other is followed.
    let covered = Picture::from_fn(480, 270, |x, y| match x < 240 {
        true => [((x * 7919 + y * 104_729) % 251) as u8; 3],
        false => picture.pixel(x, y),
    });
    let gone = (0..30).map(|_| look(&covered, &[1]).0).last();
    assert_eq!(gone, Some(vec![None, Some(true)]));
    let again = (0..3).map(|_| look(&picture, &[1, 0]).0).last();
    assert_eq!(again, Some(vec![Some(false), Some(true)]));
    video.session.remove(0);
    assert!(video.session.followed().is_empty());
}

#[test]
fn a_finder_sees_as_many_copies_in_an_image_as_it_is_asked_for() {
    let template = Template::thin_shell(print(), 297.0, 210.0).unwrap();
    let camera = training_camera().resized((960, 540)).unwrap();
    let (_, places) = two_copies(&template);
    let seen = places.each_ref().map(|place| photograph(&template, place, &camera));
    let picture = Picture::from_fn(960, 540, |x, y| seen[usize::from(x >= 480)].pixel(x, y));
    let mut finder = finder(&template);
    for copies in [1, 2, 5] {
        finder.look_for_copies(copies);
        let canonical = finder.target().canonical_camera(camera.size());
        let mut view = View::new(&picture, &camera);
        let (sightings, _) = pollster::block_on(finder.find(&mut view, &canonical)).unwrap();
        let sides: BTreeSet<bool> = sightings
            .iter()
            .map(|sighting| middle(&sighting.vertices_camera).x > 0.0)
            .collect();
        let expected = copies.min(2) as usize;
        assert_eq!((sightings.len(), sides.len()), (expected, expected), "{copies} copies");
    }
    finder.look_for_copies(2);
    let mut follower = VideoFollower::new(
        &mut finder,
        VideoOptions {
            delay: 0,
            ..VideoOptions::default()
        },
        || 0.0,
    )
    .unwrap();
    let mut view = View::new(&picture, &camera);
    let frame = pollster::block_on(follower.follow(0.0, &mut view)).unwrap();
    assert!(frame.followed.found && frame.copies.len() == 1 && frame.copies[0].found);
}
