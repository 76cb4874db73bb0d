//! Scans whose texture coordinates pass the border of their texture.

use deepsft_formats::{Scan, ScanPart, assemble_scan};
use deepsft_geometry::Picture;
use deepsft_geometry::glam::{DVec2, DVec3};

/// A square whose texture coordinates have these corners, v down, with a texture of 1000 x 1000.
fn square(low: [f64; 2], high: [f64; 2]) -> Scan {
    let corners = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)];
    let side = |t: f64, k: usize| if t == 0.0 { low[k] } else { high[k] };
    let uv = |&(s, t): &(f64, f64)| DVec2::new(side(s, 0), side(t, 1));
    Scan {
        parts: vec![ScanPart {
            name: "square".into(),
            positions: corners.iter().map(|&(x, y)| DVec3::new(x, -y, 0.0)).collect(),
            texture_coordinates: corners.iter().map(uv).collect(),
            faces: vec![[0, 3, 2], [0, 2, 1]],
            texture: Some(0),
        }],
        textures: vec![Picture::from_fn(1000, 1000, |_, _| [9; 3])],
        mm_per_unit: 100.0,
    }
}

/// The texture coordinates of the square as a template: least and greatest.
fn bounds(scan: Scan) -> ([f64; 2], [f64; 2], usize) {
    let imported = assemble_scan(scan).unwrap();
    let uv = imported.template.mesh().texture_coordinates();
    let low = uv.iter().copied().reduce(DVec2::min).unwrap();
    let high = uv.iter().copied().reduce(DVec2::max).unwrap();
    (low.to_array(), high.to_array(), imported.notes.len())
}

#[test]
fn coordinates_that_pass_the_border_by_a_hair_are_moved_onto_it() {
    assert_eq!(
        bounds(square([0.895, 0.0], [1.001, 1.0])),
        ([0.895, 0.0], [1.0, 1.0], 1)
    );
    assert_eq!(
        bounds(square([-0.0015, 0.25], [0.5, 0.5])),
        ([0.0, 0.25], [0.5, 0.5], 1)
    );
    // A small chart at the right border stays there.
    let (low, high, _) = bounds(square([0.999, 0.25], [1.0005, 0.5]));
    assert_eq!((low[0], high[0]), (0.999, 1.0));
    // Whole tiles away, and nothing to say.
    let (low, high, notes) = bounds(square([3.25, -1.75], [3.5, -1.5]));
    assert_eq!((low, high, notes), ([0.25, 0.25], [0.5, 0.5], 0));
}

#[test]
fn a_texture_that_repeats_is_refused_with_what_to_do() {
    for (low, high) in [
        ([0.0, 0.0], [1.05, 1.0]),
        ([0.5, 0.0], [1.5, 1.0]),
        ([0.0, -0.5], [1.0, 1.5]),
    ] {
        let error = assemble_scan(square(low, high)).unwrap_err().to_string();
        assert!(error.contains("repeated") && error.contains("unwrap"), "{error}");
    }
}
