//! Prints on bent sheets in synthetic frames: any way up, half hidden, in bad light.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use deepsft_finding::{FeatureFinder, FeatureOptions, Features, PictureTarget, feature_image};
use deepsft_geometry::fitting::{FitOptions, FrameFitter};
use deepsft_geometry::{CanonicalWarp, Maps, Picture, Template, training_camera};
use deepsft_synth::painting::artwork;
use deepsft_synth::random::{Stream, generator};
use deepsft_synth::{SynthConfig, Synthesizer};

/// A print of the kind collage, on a sheet 297 mm wide.
fn print(seed: u64) -> Template {
    let (_, picture) = artwork(0, &mut generator(seed, 0, Stream::Scene));
    let height = 297.0 * picture.height() as f64 / picture.width() as f64;
    Template::thin_shell(picture, 297.0, height).unwrap()
}

/// Frames as a camera of 960 x 540 pixels takes them.
fn synthesizer(template: &Template) -> Synthesizer {
    let config = SynthConfig {
        camera: training_camera().resized(960, 540).unwrap(),
        empty_probability: 0.0,
        least_visible_px: 6000,
        ..SynthConfig::default()
    };
    Synthesizer::new(template, config).unwrap()
}

/// The maps that the finder has of an image, for a camera of the image's size.
fn found(finder: &mut FeatureFinder, image: &Picture) -> Option<Maps> {
    let camera = training_camera().resized(960, 540).unwrap();
    let (image, camera) = feature_image(image, &camera).unwrap();
    let features = Features::of(&image, &FeatureOptions::default());
    finder
        .find(&features, &camera, &camera)
        .unwrap()
        .map(|sheet| sheet.maps)
}

#[test]
fn a_bent_print_is_found_to_two_canonical_pixels_any_way_up() {
    let template = print(1);
    let synthesizer = synthesizer(&template);
    let mut finder = FeatureFinder::new(PictureTarget::new(template.clone()).unwrap()).unwrap();
    let within: Vec<bool> = (0..8)
        .map(|index| {
            let sample = synthesizer.sample(77, index);
            let maps = found(&mut finder, &sample.image).unwrap();
            let mut errors: Vec<f64> = (0..maps.depth().len())
                .filter(|&p| sample.truth.inside(p) && maps.inside(p))
                .map(|p| {
                    let off = ((sample.truth.uv(p) - maps.uv(p)) * template.size_mm()).length();
                    off * training_camera().focal().x / f64::from(sample.truth.depth()[p])
                })
                .collect();
            errors.sort_by(f64::total_cmp);
            errors.len() * 10 > sample.truth.area() * 9 && errors[errors.len() / 2] < 2.0
        })
        .collect();
    // The study finds collages in 97 to 100 % of such frames.
    assert!(within.iter().filter(|&&w| w).count() >= 7, "{within:?}");
}

#[test]
fn another_print_in_its_place_is_not_found_or_its_fit_tells() {
    let (shown, sought) = (print(1), print(2));
    let synthesizer = synthesizer(&shown);
    let mut finder = FeatureFinder::new(PictureTarget::new(sought.clone()).unwrap()).unwrap();
    let mut fitter = FrameFitter::new(&sought, FitOptions::default()).unwrap();
    let large = training_camera().resized(960, 540).unwrap();
    let warp = CanonicalWarp::new(&large, &training_camera());
    for index in 0..8 {
        let image = synthesizer.sample(77, index).image;
        let (small, camera) = feature_image(&image, &large).unwrap();
        let features = Features::of(&small, &FeatureOptions::default());
        let Some(sheet) = finder.find(&features, &camera, &training_camera()).unwrap() else {
            continue;
        };
        let canonical = warp.apply(&image).unwrap();
        if let Some(fit) = fitter.fit(&canonical, &training_camera(), &sheet.maps, None).unwrap() {
            assert!(fit.agreement < 0.6, "frame {index}: {}", fit.agreement);
        }
    }
}

#[test]
fn nothing_is_found_in_images_without_corners_or_for_prints_without_any() {
    let mut finder = FeatureFinder::new(PictureTarget::new(print(1)).unwrap()).unwrap();
    assert!(found(&mut finder, &Picture::from_fn(960, 540, |x, _| [(x / 4) as u8; 3])).is_none());
    let blank = PictureTarget::picture(Picture::from_fn(300, 200, |_, _| [230; 3]), 200.0).unwrap();
    let mut finder = FeatureFinder::new(blank).unwrap();
    assert!(found(&mut finder, &synthesizer(&print(1)).sample(77, 0).image).is_none());
}
