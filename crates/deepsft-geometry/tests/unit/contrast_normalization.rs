//! Pictures freed from light and exposure.

use deepsft_geometry::Picture;
use deepsft_geometry::glam::DVec2;
use deepsft_geometry::solver::ContrastNormalizedImage;

#[test]
fn a_darker_picture_with_less_contrast_has_nearly_the_same_normalised_values() {
    let pattern = |x: usize, y: usize| 40 + (x * 37 + y * 61) % 160;
    let bright = Picture::from_fn(60, 50, |x, y| [pattern(x, y) as u8; 3]);
    let dark = Picture::from_fn(60, 50, |x, y| [(10 + pattern(x, y) / 2) as u8; 3]);
    let [bright, dark] = [bright, dark].map(|picture| {
        let image = ContrastNormalizedImage::new(&picture, 1.0, 8.0);
        let centres = (0..59 * 49).map(|k| DVec2::new((k % 59) as f64, (k / 59) as f64) + 0.5);
        centres.map(|at| image.sample(at).unwrap().0).collect::<Vec<f64>>()
    });
    let apart: f64 = bright.iter().zip(&dark).map(|(a, b)| (a - b).powi(2)).sum();
    let size: f64 = bright.iter().map(|a| a * a).sum();
    // The 4 grey levels and rounding to bytes: a fifth of a deviation of some 10 grey levels.
    assert!(size > 100.0 && apart < 0.1 * size, "{apart} {size}");
}
