//! Where the lines of a wireframe lie.

use crate::output::wireframe::wireframe;
use deepsft_geometry::glam::DVec3;
use deepsft_geometry::{Picture, Template, training_camera};

/// Colours of lines that the image does not confirm, and that it confirms fully.
const DOUBTFUL: [u8; 3] = [235, 40, 60];
const CERTAIN: [u8; 3] = [60, 245, 110];

#[test]
fn the_outline_of_a_frontal_sheet_is_drawn_where_it_is() {
    // 380 mm away at f = 380 a millimetre is a pixel: 200 x 101 mm about the centre (240, 135), whose top edge goes
    // through the pixels' centres at 84.5.
    let template = Template::thin_shell(Picture::from_fn(1, 1, |_, _| [0; 3]), 200.0, 101.0).unwrap();
    let vertices: Vec<DVec3> = template
        .mesh()
        .vertices()
        .iter()
        .map(|p| *p + DVec3::Z * 380.0)
        .collect();
    let black = Picture::from_fn(480, 270, |_, _| [0; 3]);
    let certain = wireframe(&black, &training_camera(), &template, &vertices, &[]);
    let lit = |x: usize, y: usize| certain.pixel(x, y) != [0; 3];
    for x in 141..339 {
        assert!(lit(x, 84), "top edge at column {x}");
    }
    assert!((0..270).all(|y| !lit(135, y) && !lit(345, y)));
    assert_eq!(certain.pixel(240, 84), CERTAIN);
    let doubtful = wireframe(
        &black,
        &training_camera(),
        &template,
        &vertices,
        &vec![0.0; vertices.len()],
    );
    assert_eq!(doubtful.pixel(240, 84), DOUBTFUL);
    assert_eq!(wireframe(&black, &training_camera(), &template, &[], &[]), black);
}
