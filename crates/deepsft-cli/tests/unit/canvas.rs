//! What a canvas holds after drawing.

use crate::output::canvas::Canvas;
use crate::output::lettering::{Align, Lettering};
use deepsft_geometry::Picture;

#[test]
fn pictures_and_rectangles_keep_their_colours_and_are_cut_at_the_border() {
    let mut canvas = Canvas::new(6, 4, [1; 3]);
    canvas.draw(&Picture::from_fn(10, 10, |_, _| [5, 6, 7]), 4, 2);
    canvas.fill(-3.0, 0.0, 5.0, 1.0, [200, 100, 50]);
    let picture = canvas.into_picture();
    let row = |y| (0..6).map(|x| picture.pixel(x, y)[0]).collect::<Vec<u8>>();
    assert_eq!([row(0), row(2)], [[200, 200, 1, 1, 1, 1], [1, 1, 1, 1, 5, 5]]);
    assert_eq!(Canvas::of(&picture).into_picture(), picture);
}

#[test]
fn a_line_covers_the_pixels_it_passes_through_by_what_lies_on_them() {
    let mut canvas = Canvas::new(8, 8, [0; 3]);
    // Two pixels wide about y = 3: rows 2 and 3 whole.
    canvas.line(&[(0.0, 3.0), (8.0, 3.0)], 2.0, [240; 3]);
    // One pixel wide about x = 6: half of columns 5 and 6.
    canvas.line(&[(6.0, 4.0), (6.0, 8.0)], 1.0, [240; 3]);
    let picture = canvas.into_picture();
    for y in 0..4 {
        assert_eq!(picture.pixel(1, y), if y < 2 { [0; 3] } else { [240; 3] }, "row {y}");
    }
    assert!([5, 6].iter().all(|&x| picture.pixel(x, 6)[0].abs_diff(120) <= 2));
}

#[test]
fn a_dot_and_text_leave_their_ink() {
    let ink = |draw: &dyn Fn(&mut Canvas)| {
        let mut canvas = Canvas::new(40, 20, [0; 3]);
        draw(&mut canvas);
        let picture = canvas.into_picture();
        picture.rgb().iter().map(|&c| f64::from(c) / 255.0).sum::<f64>() / 3.0
    };
    let dot = ink(&|canvas| canvas.dot((20.0, 10.0), 5.0, [255; 3]));
    assert!((dot - 25.0 * std::f64::consts::PI).abs() < 2.0, "{dot}");
    let lettering = Lettering::regular(16.0, [255; 3]);
    let whole = ink(&|canvas| canvas.write("mm", (20.0, 10.0), Align::Centre, lettering));
    let cut = ink(&|canvas| canvas.write("mm", (0.0, 10.0), Align::Centre, lettering));
    assert!(whole > 40.0 && cut < 0.6 * whole && cut > 0.4 * whole, "{whole} {cut}");
}
