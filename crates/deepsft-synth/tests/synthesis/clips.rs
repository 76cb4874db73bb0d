//! Clips with something that happens in them.

use deepsft_geometry::glam::DVec3;
use deepsft_geometry::{Picture, Template, training_camera};
use deepsft_synth::{ClipEvent, ClipLength, ClipStory, FIRST_CLIP_SEED, Sample, SynthConfig, SynthError, Synthesizer};

fn template() -> Template {
    let art = Picture::from_fn(120, 85, |x, y| {
        [(2 * x) as u8, (3 * y) as u8, ((x / 6 + y / 6) % 2 * 200) as u8]
    });
    Template::thin_shell(art, 297.0, 210.0).unwrap()
}

fn synthesizer() -> Synthesizer {
    Synthesizer::new(&template(), SynthConfig::for_clip_stories(training_camera())).unwrap()
}

fn story(synthesizer: &Synthesizer, event: ClipEvent, seed: u64) -> ClipStory<'_> {
    ClipStory::new(synthesizer, ClipLength::default(), event, seed).unwrap()
}

fn seeds() -> std::ops::Range<u64> {
    FIRST_CLIP_SEED + 100..FIRST_CLIP_SEED + 104
}

/// Mean way of the vertices in the image from a frame to the next, pixels.
fn step_px(story: &ClipStory<'_>, frame: usize) -> f64 {
    let camera = training_camera();
    let pixels = |frame: usize| -> Vec<_> {
        let vertices = story.vertices_camera(frame as f64);
        vertices.iter().map(|p| camera.project(*p).unwrap()).collect()
    };
    let (a, b) = (pixels(frame), pixels(frame + 1));
    a.iter().zip(&b).map(|(a, b)| a.distance(*b)).sum::<f64>() / a.len() as f64
}

/// Root mean square and mean of the difference of two pictures, grey levels.
fn difference(a: &Picture, b: &Picture) -> (f64, f64) {
    let differences = || a.rgb().iter().zip(b.rgb()).map(|(a, b)| f64::from(*a) - f64::from(*b));
    let count = a.rgb().len() as f64;
    (
        (differences().map(|d| d * d).sum::<f64>() / count).sqrt(),
        differences().sum::<f64>() / count,
    )
}

#[test]
fn still_means_that_only_the_noise_differs() {
    let synthesizer = synthesizer();
    for seed in seeds() {
        let story = story(&synthesizer, ClipEvent::Still, seed);
        let [first, second, last] = [0, 1, 59].map(|frame| story.render(frame).unwrap());
        assert_eq!(story.vertices_camera(0.0), story.vertices_camera(37.4));
        for other in [&second, &last] {
            assert_eq!(other.truth, first.truth);
            let (rms, mean) = difference(&first.image, &other.image);
            // Noise of 1 to 3 levels, stronger by at most 1.35 in the dark, in both pictures; a mean of 388,800
            // differences is near zero to 3 * 1.35 * sqrt(2 / 388800) = 0.01, clipped values aside.
            assert!((0.5..6.0).contains(&rms), "seed {seed}: {rms}");
            assert!(mean.abs() < 0.05, "seed {seed}: {mean}");
        }
    }
}

#[test]
fn a_sheet_that_leaves_is_gone_and_comes_back_without_a_jump() {
    let synthesizer = synthesizer();
    for seed in seeds() {
        let story = story(&synthesizer, ClipEvent::Leaving, seed);
        for frame in [0, 5, 54, 59] {
            let sample = story.render(frame).unwrap();
            assert!(sample.truth.area() > 1500, "seed {seed}, frame {frame}");
        }
        for frame in 26..=32 {
            let sample = story.render(frame).unwrap();
            assert_eq!(sample.truth.area(), 0, "seed {seed}, frame {frame}");
            assert!(!sample.has_template);
        }
        // No faster than the fastest hand in view: 1.5 m/s at 330 mm are 58 pixels per frame.
        let fastest = (0..59).map(|frame| step_px(&story, frame)).fold(0.0, f64::max);
        assert!(fastest < 58.0, "seed {seed}: {fastest} px a frame");
    }
}

#[test]
fn a_cut_is_a_jump_and_the_only_one() {
    let synthesizer = synthesizer();
    for seed in seeds() {
        let story = story(&synthesizer, ClipEvent::JumpCut, seed);
        let cut = story.event_frames().start;
        assert!((24..=36).contains(&cut), "{cut}");
        let jump = step_px(&story, cut - 1);
        assert!(jump > 0.1 * 480.0, "seed {seed}: {jump} px");
        for frame in (0..59).filter(|frame| *frame != cut - 1) {
            let step = step_px(&story, frame);
            assert!(step < jump / 2.0, "seed {seed}, frame {frame}: {step} of {jump} px");
        }
        // An exposure does not mix two shots.
        assert_eq!(
            story.render(cut).unwrap().vertices_camera,
            story.vertices_camera(cut as f64)
        );
    }
}

#[test]
fn an_arm_covers_a_part_of_the_sheet_while_it_passes_and_nothing_before_and_after() {
    let synthesizer = synthesizer();
    let mut most = Vec::new();
    for seed in seeds() {
        let covered = |sample: &Sample, free: &Sample| 1.0 - sample.truth.area() as f64 / free.truth.area() as f64;
        let (passing, free) = (
            story(&synthesizer, ClipEvent::Occlusion, seed),
            story(&synthesizer, ClipEvent::Motion, seed),
        );
        let fraction = |frame: usize| covered(&passing.render(frame).unwrap(), &free.render(frame).unwrap());
        assert_eq!(passing.event_frames(), 15..45);
        assert_eq!([fraction(3), fraction(14), fraction(46)], [0.0; 3]);
        assert_eq!(passing.render(3).unwrap().image, free.render(3).unwrap().image);
        most.push((18..43).step_by(4).map(fraction).fold(0.0, f64::max));
    }
    assert!(most.iter().all(|fraction| (0.05..0.9).contains(fraction)), "{most:.2?}");
    assert!(most.iter().any(|fraction| *fraction > 0.2), "{most:.2?}");
}

#[test]
fn a_longer_exposure_blurs_what_moves_and_leaves_the_truth() {
    let synthesizer = synthesizer();
    let seed = seeds().start;
    let with = |exposure_s: f64| {
        let length = ClipLength {
            exposure_s,
            ..ClipLength::default()
        };
        ClipStory::new(&synthesizer, length, ClipEvent::Motion, seed).unwrap()
    };
    let story = with(0.0);
    let fastest = (0..59)
        .max_by(|a, b| step_px(&story, *a).total_cmp(&step_px(&story, *b)))
        .unwrap();
    // Something to blur: 3 pixels per frame at least.
    assert!(step_px(&story, fastest) > 3.0);
    let samples = [0.0, 1.0 / 30.0].map(|exposure| with(exposure).render(fastest).unwrap());
    assert_eq!(samples[0].truth, samples[1].truth);
    let sharpness = |sample: &Sample| {
        let (truth, image) = (&sample.truth, &sample.image);
        let inside = (0..truth.depth().len() - 1).filter(|&p| truth.inside(p) && truth.inside(p + 1));
        let green = |pixel: usize| f64::from(image.rgb()[3 * pixel + 1]);
        let blue = |pixel: usize| f64::from(image.rgb()[3 * pixel + 2]);
        // Squares: a blurred edge has the same steps in sum, but smaller ones.
        let steps = inside.map(|p| (green(p) - green(p + 1)).powi(2) + (blue(p) - blue(p + 1)).powi(2));
        steps.sum::<f64>() / truth.area() as f64
    };
    let [sharp, blurred] = [&samples[0], &samples[1]].map(sharpness);
    // Most of what differs from pixel to pixel is sensor noise and lies across the motion.
    assert!(blurred < 0.99 * sharp, "{blurred} of {sharp}");
}

#[test]
fn the_seed_and_nothing_else_decides() {
    let synthesizer = synthesizer();
    for &event in ClipEvent::ALL {
        let seed = seeds().start;
        let sample = story(&synthesizer, event, seed).render(20).unwrap();
        assert!(
            sample == story(&synthesizer, event, seed).render(20).unwrap(),
            "{event:?}"
        );
        let other = story(&synthesizer, event, seed + 1).render(20).unwrap();
        assert!(sample.image != other.image, "{event:?}");
    }
}

#[test]
fn vertices_between_two_frames_lie_between_them() {
    let synthesizer = synthesizer();
    let story = story(&synthesizer, ClipEvent::Motion, seeds().start);
    let at = |frame: f64| story.vertices_camera(frame);
    let (a, middle, b) = (at(10.0), at(10.5), at(11.0));
    let farthest = |p: &[DVec3], q: &[DVec3]| p.iter().zip(q).map(|(p, q)| p.distance(*q)).fold(0.0, f64::max);
    let mean: Vec<DVec3> = a.iter().zip(&b).map(|(a, b)| (*a + *b) / 2.0).collect();
    assert!(farthest(&middle, &mean) < 0.1 * farthest(&a, &b));
}

#[test]
fn lengths_that_are_none_are_refused_by_name() {
    let synthesizer = synthesizer();
    for (length, name) in [
        (
            ClipLength {
                frames: 0,
                ..ClipLength::default()
            },
            "clip.frames",
        ),
        (
            ClipLength {
                frames_per_s: f64::NAN,
                ..ClipLength::default()
            },
            "clip.frames_per_s",
        ),
        (
            ClipLength {
                exposure_s: 0.1,
                ..ClipLength::default()
            },
            "clip.exposure_s",
        ),
    ] {
        let error = ClipStory::new(&synthesizer, length, ClipEvent::Motion, 1).unwrap_err();
        assert!(
            matches!(error, SynthError::Setting { parameter, .. } if parameter == name),
            "{error}"
        );
    }
}
