//! The views of a turntable.

use crate::output::turntable::turntable;
use deepsft_geometry::glam::{DVec2, DVec3};
use deepsft_geometry::{Picture, Template, TriangleMesh};

#[test]
fn each_side_of_a_cube_is_in_its_view() {
    // Six charts side by side, each of one colour, in the order of the views. Corners: outwards counter-clockwise.
    let (x, y, z) = (DVec3::X, DVec3::Y, DVec3::Z);
    let sides = [(-z, y, x), (x, y, z), (z, y, -x), (-x, y, -z), (-y, -z, x), (y, z, x)];
    let (mut vertices, mut uv, mut faces) = (vec![], vec![], vec![]);
    for (k, (outwards, down, right)) in sides.into_iter().enumerate() {
        let n = vertices.len();
        for (a, b) in [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)] {
            vertices.push(50.0 * (outwards + a * down + b * right));
            uv.push(DVec2::new((k as f64 + 0.5 + 0.4 * b) / 6.0, 0.5 + 0.4 * a));
        }
        faces.extend([[n, n + 1, n + 2], [n, n + 2, n + 3]]);
    }
    let colors = [
        [250, 0, 0],
        [0, 250, 0],
        [0, 0, 250],
        [250, 250, 0],
        [0, 250, 250],
        [250, 0, 250],
    ];
    let texture = Picture::from_fn(60, 10, |x, _| colors[x / 10]);
    let template = Template::of_mesh(TriangleMesh::new(vertices, uv, faces).unwrap(), texture).unwrap();
    let picture = turntable(&template, None).unwrap();
    let side = picture.width() / 3;
    for (k, color) in colors.into_iter().enumerate() {
        let seen = picture.pixel(k % 3 * side + side / 2, k / 3 * side + side / 2);
        for channel in 0..3 {
            assert!(
                seen[channel].abs_diff(color[channel]) < 30,
                "view {k}: {seen:?} for {color:?}"
            );
        }
    }
}
