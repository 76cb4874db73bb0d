//! Maps against the truth, with errors worked out by hand.

use deepsft_geometry::glam::DVec2;
use deepsft_geometry::metrics::{FrameMetrics, Summary, frame_metrics, registration_error_px};
use deepsft_geometry::{GeometryError, Maps, training_camera};

const SHEET_MM: DVec2 = DVec2::new(200.0, 100.0);

/// Maps are f32: depths near 500 are exact, texture coordinates good to 2^-24, which the inverse
/// Jacobian (up to 400 px per unit of u here, 200 of v) turns into 2.4e-5 px.
const F32_PX: f64 = 5e-5;

/// A plane of constant depth 380 mm: one pixel is 1 mm at f = 380. Texture (0, 0) is at the pixel
/// corner (100, 50), the sheet fills 200 x 100 pixels.
fn frontal() -> Maps {
    let mut maps = Maps::empty((480, 270));
    for y in 50..150 {
        for x in 100..300 {
            let uv = [(x as f32 + 0.5 - 100.0) / 200.0, (y as f32 + 0.5 - 50.0) / 100.0];
            maps.set(y * 480 + x, 380.0, uv);
        }
    }
    maps
}

fn changed(maps: &Maps, change: impl Fn(usize, f32, [f32; 2]) -> Option<(f32, [f32; 2])>) -> Maps {
    let mut out = maps.clone();
    for pixel in 0..maps.depth().len() {
        if maps.inside(pixel) {
            match change(pixel, maps.depth()[pixel], maps.registration()[pixel]) {
                Some((depth, uv)) => out.set(pixel, depth, uv),
                None => out.clear(pixel),
            }
        }
    }
    out
}

fn compare(predicted: &Maps, truth: &Maps) -> FrameMetrics {
    frame_metrics(predicted, truth, &training_camera(), SHEET_MM).unwrap()
}

/// The figures of maps without any error.
const EXACT: FrameMetrics = FrameMetrics {
    depth_rmse_mm: Some(0.0),
    registration_rmse_px: Some(0.0),
    registration_rmse_mm: Some(0.0),
    points_rmse_mm: Some(0.0),
    mask_iou: Some(1.0),
    coverage: Some(1.0),
};

/// Asserts that the registration is off by `px` and `mm`, and nothing else at all.
fn assert_registration_off(predicted: &Maps, truth: &Maps, px: f64, mm: f64) {
    let metrics = compare(predicted, truth);
    let errors = [
        metrics.registration_rmse_px.unwrap() - px,
        metrics.registration_rmse_mm.unwrap() - mm,
    ];
    assert!(errors.into_iter().all(|error| error.abs() < F32_PX), "{metrics:?}");
    let others = FrameMetrics {
        registration_rmse_px: Some(0.0),
        registration_rmse_mm: Some(0.0),
        ..metrics
    };
    assert_eq!(others, EXACT);
}

#[test]
fn the_truth_itself_has_no_error() {
    assert_eq!(compare(&frontal(), &frontal()), EXACT);
}

#[test]
fn a_shift_of_three_and_four_pixels_is_five_pixels_and_five_millimetres() {
    let truth = frontal();
    // 3 px = 3 mm = 3 / 200 in u; 4 px = 4 mm = 4 / 100 in v; hypotenuse 5.
    let predicted = changed(&truth, |_, depth, [u, v]| Some((depth, [u + 0.015, v + 0.04])));
    assert_registration_off(&predicted, &truth, 5.0, 5.0);
    // The overlay sits 3 px to the left and 4 px above: the pixel says what is right of and below it.
    let at = |pixel| registration_error_px(&predicted, &truth, &training_camera(), pixel, SHEET_MM);
    let displacement = at(100 * 480 + 200).unwrap();
    assert!(
        (displacement - DVec2::new(3.0, 4.0)).length() < F32_PX,
        "{displacement}"
    );
    // A corner of the sheet lacks neighbours, the first pixel the sheet, the last the image.
    assert_eq!([at(50 * 480 + 100), at(0), at(480 * 270)], [None; 3]);
}

#[test]
fn a_rotated_sheet_twice_as_far_has_half_the_pixels_for_the_same_millimetres() {
    // In-plane rotation by 90 degrees at 760 mm: a pixel is 2 mm, x runs along v, y against u.
    let mut truth = Maps::empty((480, 270));
    for y in 0..100 {
        for x in 0..50 {
            let uv = [1.0 - (y as f32 + 0.5) / 100.0, (x as f32 + 0.5) / 50.0];
            truth.set((y + 20) * 480 + x + 30, 760.0, uv);
        }
    }
    let predicted = changed(&truth, |_, depth, [u, v]| Some((depth, [u + 0.03, v])));
    assert_registration_off(&predicted, &truth, 3.0, 6.0);
}

#[test]
fn a_slanted_sheet_moves_less_in_the_image_than_on_the_template() {
    // Foreshortened by 60 degrees along x: a pixel is 2 mm of template in u and 1 mm in v.
    let truth = changed(&frontal(), |_, depth, [u, v]| {
        (u < 0.5).then_some((depth, [2.0 * u, v]))
    });
    let predicted = changed(&truth, |_, depth, [u, v]| Some((depth, [u + 0.02, v + 0.03])));
    // Template (4, 3) mm; image (2, 3) px.
    assert_registration_off(&predicted, &truth, 13.0_f64.sqrt(), 5.0);
}

#[test]
fn a_depth_error_on_half_of_the_pixels_enters_as_a_root_mean_square() {
    let truth = frontal();
    let predicted = changed(&truth, |pixel, depth, uv| {
        Some((depth + if pixel % 2 == 0 { 4.0 } else { 0.0 }, uv))
    });
    let metrics = compare(&predicted, &truth);
    assert!((metrics.depth_rmse_mm.unwrap() - 8.0_f64.sqrt()).abs() < 1e-12);
    // Points move along their rays, which are longer than their z.
    assert!(metrics.points_rmse_mm > metrics.depth_rmse_mm);
}

#[test]
fn a_point_error_is_the_depth_error_times_the_length_of_the_ray() {
    // The ray through pixel (430, 134) of the 380-pixel camera is (190.5, -0.5, 380) / 380.
    let (mut truth, mut predicted) = (Maps::empty((480, 270)), Maps::empty((480, 270)));
    truth.set(134 * 480 + 430, 400.0, [0.5; 2]);
    predicted.set(134 * 480 + 430, 410.0, [0.5; 2]);
    let expected = 10.0 * (190.5_f64.powi(2) + 0.25 + 380.0_f64.powi(2)).sqrt() / 380.0;
    assert!((compare(&predicted, &truth).points_rmse_mm.unwrap() - expected).abs() < 1e-9);
}

#[test]
fn a_mask_shifted_by_half_its_width_has_an_iou_of_one_third() {
    let truth = frontal();
    let mut predicted = Maps::empty((480, 270));
    for pixel in (0..truth.depth().len()).filter(|&pixel| truth.inside(pixel)) {
        predicted.set(pixel + 100, 380.0, truth.registration()[pixel]);
    }
    let metrics = compare(&predicted, &truth);
    assert_eq!(metrics.mask_iou, Some(1.0 / 3.0));
    assert_eq!(metrics.coverage, Some(0.5));
}

#[test]
fn frames_without_overlap_have_masks_to_compare_but_no_errors() {
    let (truth, nothing) = (frontal(), Maps::empty((480, 270)));
    let masks = |mask_iou, coverage| FrameMetrics {
        mask_iou,
        coverage,
        ..FrameMetrics::default()
    };
    assert_eq!(compare(&nothing, &truth), masks(Some(0.0), Some(0.0)));
    assert_eq!(compare(&truth, &nothing), masks(Some(0.0), None));
    assert_eq!(compare(&nothing, &nothing), FrameMetrics::default());
}

#[test]
fn pixels_beside_a_depth_jump_are_left_out_of_the_figure_in_pixels() {
    // Rows from 100 on lie 20 % further away, and the prediction is wrong only along the jump.
    let truth = changed(&frontal(), |pixel, _, uv| {
        Some((if pixel / 480 < 100 { 380.0 } else { 456.0 }, uv))
    });
    let predicted = changed(&truth, |pixel, depth, [u, v]| {
        let beside = (99..=100).contains(&(pixel / 480));
        Some((depth, [if beside { u + 0.5 } else { u }, v]))
    });
    let metrics = compare(&predicted, &truth);
    assert_eq!(metrics.registration_rmse_px, Some(0.0));
    // 2 of 100 rows are off by 100 mm.
    assert!((metrics.registration_rmse_mm.unwrap() - 2.0_f64.sqrt() * 10.0).abs() < 1e-6);
}

#[test]
fn a_registration_that_stands_still_has_no_figure_in_pixels() {
    let truth = changed(&frontal(), |_, depth, [_, v]| Some((depth, [0.5, v])));
    let predicted = changed(&truth, |_, depth, [u, v]| Some((depth, [u + 0.1, v])));
    let metrics = compare(&predicted, &truth);
    assert_eq!(metrics.registration_rmse_px, None);
    assert!((metrics.registration_rmse_mm.unwrap() - 20.0).abs() < 1e-5);
}

#[test]
fn maps_of_another_size_are_refused() {
    let found = frame_metrics(&Maps::empty((240, 135)), &frontal(), &training_camera(), SHEET_MM);
    let (actual, expected) = ((240, 135).into(), (480, 270).into());
    assert_eq!(found, Err(GeometryError::MapSize { actual, expected }));
}

#[test]
fn the_median_of_an_even_number_is_the_mean_of_the_middle_two() {
    let summary = Summary::of([Some(4.0), Some(1.0), Some(2.0), Some(9.0)]).unwrap();
    assert_eq!((summary.mean, summary.median, summary.frames), (4.0, 3.0, 4));
    assert_eq!(Summary::of([None, None]), None);
}
