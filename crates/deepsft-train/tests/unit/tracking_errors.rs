//! Tracked meshes against the truth of synthetic frames.

use deepsft_geometry::glam::DVec3;
use deepsft_geometry::metrics::frame_metrics;
use deepsft_geometry::{Maps, Template};
use deepsft_geometry::{Picture, training_camera};
use deepsft_synth::Sample;
use deepsft_synth::{SynthConfig, Synthesizer};
use deepsft_train::tracking_errors::{mesh_errors, print_in_view, truth_maps};

fn template() -> Template {
    Template::thin_shell(
        Picture::from_fn(30, 20, |x, y| [(8 * x) as u8, (12 * y) as u8, 90]),
        300.0,
        200.0,
    )
    .unwrap()
}

fn flat(template: &Template, z: f64) -> Vec<DVec3> {
    template.mesh().vertices().iter().map(|p| *p + DVec3::Z * z).collect()
}

/// A frame of a flat sheet seen by a camera of the size of the training camera's image times `scale`.
fn sample(template: &Template, scale: usize) -> Sample {
    let config = SynthConfig {
        camera: training_camera().resized((480 * scale, 270 * scale)).unwrap(),
        ..SynthConfig::default()
    };
    let synthesizer = Synthesizer::new(template, config).unwrap();
    synthesizer.render_clean(flat(template, 500.0)).unwrap()
}

#[test]
fn the_truth_of_a_finer_camera_is_that_of_the_canonical_one() {
    let template = template();
    let [own, finer] = [1, 2].map(|scale| sample(&template, scale));
    let camera = training_camera();
    let truth = truth_maps(&own, &template, &camera).unwrap();
    assert_eq!(truth, own.truth);
    let derived = truth_maps(&finer, &template, &camera).unwrap();
    let metrics = frame_metrics(&derived, &truth, &camera, template.size_mm()).unwrap();
    // Pixels along the outline may differ: 760 of 35,000.
    assert!(metrics.mask_iou.unwrap() > 0.97, "{metrics:?}");
    assert!(metrics.registration_rmse_px.unwrap() < 1e-3 && metrics.depth_rmse_mm.unwrap() < 1e-3);
    // What lies before the sheet stays out of its truth.
    let mut covered = finer.clone();
    let (width, half) = (960, 480);
    (0..540 * width)
        .filter(|pixel| pixel % width < half)
        .for_each(|pixel| covered.truth.clear(pixel));
    let derived = truth_maps(&covered, &template, &camera).unwrap();
    assert!((0..480 * 270).all(|pixel| pixel % 480 >= 240 || !derived.inside(pixel)));
    assert!(derived.area() > 15_000);
}

#[test]
fn a_sheet_that_is_moved_by_three_pixels_is_three_pixels_off() {
    let template = template();
    let own = sample(&template, 1);
    // 3 pixels at 500 mm and f = 380.
    let moved: Vec<DVec3> = flat(&template, 500.0)
        .into_iter()
        .map(|p| p + DVec3::X * 3.0 * 500.0 / 380.0)
        .collect();
    let metrics = mesh_errors(&template, &moved, &own.truth, &training_camera()).unwrap();
    assert!(
        (metrics.registration_rmse_px.unwrap() - 3.0).abs() < 1e-3,
        "{metrics:?}"
    );
}

#[test]
fn the_fraction_in_view_is_counted() {
    let whole = sample(&template(), 1).truth;
    let mut half = whole.clone();
    (0..480 * 270)
        .filter(|pixel| pixel % 480 >= 240)
        .for_each(|pixel| half.clear(pixel));
    assert_eq!(
        [&whole, &half, &Maps::empty((480, 270))].map(print_in_view),
        [1.0, 0.5, 0.0]
    );
}
