//! The visible surface as a mesh.

use deepsft_geometry::glam::DVec2;
use deepsft_geometry::{Maps, training_camera, visible_surface};

fn plane(depth: impl Fn(usize) -> Option<f32>) -> Maps {
    let mut maps = Maps::empty((480, 270));
    for p in 0..480 * 270 {
        if let Some(depth) = depth(p % 480) {
            maps.set(p, depth, [0.25, 0.75]);
        }
    }
    maps
}

#[test]
fn a_frontal_plane_has_the_area_that_its_pixels_cover() {
    // 380 mm away at f = 380 a pixel is 1 mm: vertices at columns 0, 2 ... 478 and rows 0 ... 268.
    let mesh = visible_surface(&plane(|_| Some(380.0)), &training_camera()).unwrap();
    assert_eq!(mesh.vertices().len(), 240 * 135);
    let mut area = 0.0;
    for &[a, b, c] in mesh.faces() {
        let v = mesh.vertices();
        let normal = (v[b] - v[a]).cross(v[c] - v[a]);
        assert!(normal.z < 0.0, "seen from the camera the faces are counter-clockwise");
        area += normal.length() / 2.0;
    }
    assert!((area - 478.0 * 268.0).abs() < 1e-6);
    assert_eq!(mesh.texture_coordinates()[7], DVec2::new(0.25, 0.75));
}

#[test]
fn the_surface_is_torn_at_a_depth_jump_and_ends_at_the_mask() {
    // 40 mm at 400 mm over one step is a jump (at most 10 * 2 / 380 * 400 = 21); columns from 400 see nothing.
    let maps = plane(|x| (x < 400).then_some(if x < 200 { 400.0 } else { 440.0 }));
    let mesh = visible_surface(&maps, &training_camera()).unwrap();
    assert_eq!(mesh.faces().len(), 2 * 134 * (99 + 99));
    let empty = visible_surface(&Maps::empty((480, 270)), &training_camera()).unwrap();
    assert!(empty.faces().is_empty() && empty.vertices().is_empty());
}
