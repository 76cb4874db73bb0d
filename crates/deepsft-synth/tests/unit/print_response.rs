//! How a print differs from its template.

use crate::PrintResponse;
use crate::painting::srgb8_from_linear;
use deepsft_geometry::Picture;
use deepsft_geometry::glam::Vec3;

#[test]
fn black_turns_grey_white_turns_to_paper_and_colours_pale() {
    let response = PrintResponse {
        black: [0.05, 0.04, 0.03],
        white: [0.95, 1.0, 0.9],
        gain: 1.2,
        saturation: 0.5,
        scale: 1.0,
    };
    let colors = [[0; 3], [255; 3], [255, 0, 0]];
    let print = response.apply(&Picture::from_fn(3, 1, |x, _| colors[x]));
    let expected = |light: [f32; 3]| srgb8_from_linear(Vec3::from_array(light));
    assert_eq!(print.pixel(0, 0), expected([0.05, 0.04, 0.03]));
    assert_eq!(print.pixel(1, 0), expected([0.95, 1.0, 0.9]));
    // Grey 0.2126; half way to it: 0.6063, 0.1063, 0.1063 of the span above black.
    let red = [0.05 + 0.9 * 0.6063, 0.04 + 0.96 * 0.1063, 0.03 + 0.87 * 0.1063];
    assert_eq!(print.pixel(2, 0), expected(red));
}
