//! What a user of the synthesiser relies on, through its public interface.

use deepsft_geometry::glam::DVec3;
use deepsft_geometry::{Maps, Picture, Template, training_camera};
use deepsft_synth::{Sample, SynthConfig, SynthError, Synthesizer};

/// An A4 sheet with a colourful, nowhere repeating picture.
fn template() -> Template {
    let texture = Picture::from_fn(420, 297, |x, y| {
        let cell = (x / 20 * 7 + y / 20 * 13) % 11;
        [(x / 2) as u8, (255 - y / 2) as u8, (cell * 23) as u8]
    });
    Template::thin_shell(texture, 297.0, 210.0).unwrap()
}

fn synthesizer(config: SynthConfig) -> Synthesizer {
    Synthesizer::new(&template(), config).unwrap()
}

/// The defaults without anything random before the lens or behind it.
fn undisturbed() -> SynthConfig {
    let mut config = SynthConfig {
        empty_probability: 0.0,
        occluder_probability: 0.0,
        ..SynthConfig::default()
    };
    config.effects.bars_probability = 0.0;
    config
}

#[test]
fn a_sample_depends_on_nothing_but_seed_and_index() {
    let (a, b) = (synthesizer(SynthConfig::default()), synthesizer(SynthConfig::default()));
    for index in [0, 1, u64::MAX] {
        let forward = a.sample(5, index);
        a.sample(6, 3);
        assert_eq!(forward, b.sample(5, index));
        assert_ne!(forward.image, b.sample(6, index).image);
        assert_ne!(forward.image, b.sample(5, index.wrapping_add(1)).image);
    }
}

#[test]
fn synthesizers_can_be_shared_between_threads() {
    let synthesizer = synthesizer(SynthConfig::default());
    let here = synthesizer.sample(1, 7);
    let there = std::thread::scope(|scope| scope.spawn(|| synthesizer.sample(1, 7)).join()).unwrap();
    assert_eq!(here, there);
}

#[test]
fn a_tenth_of_the_samples_have_no_template_and_say_so() {
    let synthesizer = synthesizer(SynthConfig::default());
    let samples: Vec<Sample> = (0..200).map(|index| synthesizer.sample(2, index)).collect();
    let empty = samples.iter().filter(|sample| !sample.has_template).count();
    // Binomial, 200 draws of 0.1: 20 +- 4.2; four standard deviations.
    assert!((3..=37).contains(&empty), "{empty}");
    for sample in &samples {
        assert_eq!(sample.has_template, sample.truth.area() > 0);
        assert_eq!(sample.has_template, !sample.vertices_camera.is_empty());
        // Occluders take at most 35 % of at least 1500 pixels.
        assert!(
            !sample.has_template || sample.truth.area() >= 975,
            "{}",
            sample.truth.area()
        );
    }
}

#[test]
fn the_truth_is_consistent_with_the_mesh_it_was_rendered_from() {
    let synthesizer = synthesizer(undisturbed());
    let camera = training_camera();
    for index in 0..10 {
        let sample = synthesizer.sample(3, index);
        let clean = synthesizer.render_clean(sample.vertices_camera.clone()).unwrap();
        // Effects do not change the truth.
        assert_eq!(sample.truth, clean.truth);
        let mut checked = 0;
        for (vertex, (p, uv)) in sample
            .vertices_camera
            .iter()
            .zip(template().mesh().texture_coordinates())
            .enumerate()
        {
            let Some(pixel) = camera.project(*p) else { continue };
            let (column, row) = (pixel.x.floor(), pixel.y.floor());
            if !(0.0..480.0).contains(&column) || !(0.0..270.0).contains(&row) {
                continue;
            }
            let at = row as usize * 480 + column as usize;
            let seen = sample.truth.registration()[at];
            // Where this vertex is what the pixel sees, its (u, v) is within the pixel's footprint: a few mm.
            let near = (f64::from(sample.truth.depth()[at]) - p.z).abs() < 5.0;
            if sample.truth.inside(at) && near {
                checked += 1;
                let slip = (f64::from(seen[0]) - uv.x).abs().max((f64::from(seen[1]) - uv.y).abs());
                assert!(slip < 0.05, "vertex {vertex} of sample {index}: {slip}");
            }
        }
        assert!(checked > 100, "{checked}");
    }
}

#[test]
fn occluders_take_pixels_out_of_the_truth_but_not_more_than_their_fraction() {
    let with = SynthConfig {
        occluder_probability: 1.0,
        ..undisturbed()
    };
    let synthesizer = synthesizer(with);
    let mut fractions = Vec::new();
    for index in 0..60 {
        let sample = synthesizer.sample(4, index);
        let whole = synthesizer.render_clean(sample.vertices_camera.clone()).unwrap().truth;
        for pixel in 0..480 * 270 {
            if sample.truth.inside(pixel) {
                assert_eq!(sample.truth.depth()[pixel], whole.depth()[pixel]);
            }
        }
        fractions.push(1.0 - sample.truth.area() as f64 / whole.area() as f64);
    }
    assert!(fractions.iter().all(|&fraction| fraction <= 0.35), "{fractions:?}");
    assert!(
        fractions.iter().filter(|&&fraction| fraction > 0.0).count() > 40,
        "{fractions:?}"
    );
    assert!(fractions.iter().any(|&fraction| fraction > 0.15), "{fractions:?}");
}

#[test]
fn pictures_are_exposed_varied_and_rarely_clipped() {
    let synthesizer = synthesizer(SynthConfig::default());
    let mut clipped = 0.0;
    let mut means = Vec::new();
    for index in 0..60 {
        let image = synthesizer.sample(5, index).image;
        let values = image.rgb().len() as f64;
        clipped += image.rgb().iter().filter(|&&v| v == 255).count() as f64 / values / 60.0;
        means.push(image.rgb().iter().map(|&v| f64::from(v)).sum::<f64>() / values);
    }
    assert!(clipped < 0.1, "{clipped}");
    // Dim rooms and bright ones: the means spread over a good part of the range.
    let mean = means.iter().sum::<f64>() / 60.0;
    let deviation = (means.iter().map(|m| (m - mean) * (m - mean)).sum::<f64>() / 60.0).sqrt();
    assert!(
        (70.0..160.0).contains(&mean) && deviation > 20.0,
        "means {mean} +- {deviation}"
    );
}

#[test]
fn a_scene_keeps_its_background_and_light_while_the_sheet_moves() {
    let synthesizer = synthesizer(undisturbed());
    let scene = synthesizer.scene(9, 1);
    let flat = |x: f64| {
        template()
            .mesh()
            .vertices()
            .iter()
            .map(|p| *p + DVec3::new(x, 0.0, 900.0))
            .collect::<Vec<_>>()
    };
    let (left, right) = (
        scene.render(flat(-120.0), 1).unwrap(),
        scene.render(flat(120.0), 1).unwrap(),
    );
    assert_eq!(left.towards_light, right.towards_light);
    // The lower right corner sees the background in both; blur reaches 7 + 4 pixels at most.
    let corner = |sample: &Sample, x: usize, y: usize| sample.image.pixel(460 + x % 20, 240 + y % 30);
    let differing = (0..600).filter(|k| {
        let (a, b) = (corner(&left, k % 20, k / 20), corner(&right, k % 20, k / 20));
        (0..3).any(|c| a[c].abs_diff(b[c]) > 25)
    });
    assert!(differing.count() < 30);
    assert_ne!(left.image, right.image);
    // Another noise seed changes the noise only.
    let again = scene.render(flat(-120.0), 2).unwrap();
    assert_eq!(again.truth, left.truth);
    assert_ne!(again.image, left.image);
}

#[test]
fn photographs_serve_as_backgrounds_and_as_other_sheets() {
    let magenta = Picture::from_fn(300, 200, |x, y| [200 + (x % 40) as u8, (y % 30) as u8, 220]);
    let config = SynthConfig {
        empty_probability: 1.0,
        ..SynthConfig::default()
    };
    let plain = synthesizer(config.clone());
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("magenta.png");
    std::fs::write(&file, deepsft_formats::encode_png(&magenta).unwrap()).unwrap();
    let with = synthesizer(config).with_photographs(vec![file]).unwrap();
    let changed = (0..20)
        .filter(|&index| plain.sample(1, index).image != with.sample(1, index).image)
        .count();
    assert!(changed > 10, "{changed}");
}

#[test]
fn meshes_that_do_not_fit_are_refused() {
    let synthesizer = synthesizer(SynthConfig::default());
    let vertices = template().mesh().vertices().len();
    let error = synthesizer.render_clean(vec![DVec3::Z; 3]).unwrap_err();
    assert!(matches!(error, SynthError::VertexCount { actual: 3, expected } if expected == vertices));
    assert!(matches!(
        synthesizer.render_clean(vec![DVec3::NAN; vertices]),
        Err(SynthError::Template(_))
    ));
    // Behind the camera: nothing is seen.
    let behind = synthesizer.render_clean(vec![DVec3::NEG_Z; vertices]).unwrap();
    assert_eq!(behind.truth, Maps::empty((480, 270)));
    assert!(!behind.has_template);
}

#[test]
fn a_configuration_that_cannot_be_is_refused_by_name() {
    type Change = fn(&mut SynthConfig);
    let refused: [(Change, &str); 5] = [
        (
            |config| config.empty_probability = -0.1,
            "synthesis setting empty_probability is -0.1, expected 0 to 1",
        ),
        (|config| config.empty_probability = 1.5, "empty_probability is 1.5"),
        (|config| config.effects.gain = [2.0, 1.0], "effects.gain is [2, 1]"),
        (
            |config| config.lighting.roughness = [f64::NAN, 1.0],
            "lighting.roughness",
        ),
        (
            |config| config.camera = config.camera.with_distortion([0.1, 0.0, 0.0, 0.0, 0.0]).unwrap(),
            "lens distortion",
        ),
    ];
    for (change, part) in refused {
        let mut config = SynthConfig::paper();
        assert!(Synthesizer::new(&template(), config.clone()).is_ok());
        change(&mut config);
        let error = Synthesizer::new(&template(), config).unwrap_err().to_string();
        assert!(error.contains(part), "{error}");
    }
    assert!(Synthesizer::new(&template(), SynthConfig::default()).is_ok());
}
