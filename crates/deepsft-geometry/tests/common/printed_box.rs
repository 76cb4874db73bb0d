//! A box whose sides are charts of one texture.
#![allow(dead_code)] // Each test uses a part of it.

use deepsft_geometry::glam::{DVec2, DVec3};
use deepsft_geometry::{Picture, Template, TriangleMesh};

/// Sides of the box, mm.
pub const SIDES: DVec3 = DVec3::new(60.0, 100.0, 40.0);

/// Side `k` at (s, t) in the unit square: its point of the unit cube and its place in the texture, a tile of 3 x 2.
pub fn on_side(k: usize, at: DVec2) -> (DVec3, DVec2) {
    let (axis, end) = (k / 2, (k % 2) as f64);
    let mut point = [0.0; 3];
    (point[axis], point[(axis + 1) % 3], point[(axis + 2) % 3]) = (end, at.x, at.y);
    // A tile is as wide as the longest side.
    let at = at * DVec2::new(SIDES[(axis + 1) % 3], SIDES[(axis + 2) % 3]) / SIDES.max_element();
    // Opposite sides run opposite ways, so that none is a mirror image from outside.
    let place = if k.is_multiple_of(2) {
        at
    } else {
        DVec2::new(at.y, at.x)
    };
    let tile = DVec2::new((k % 3) as f64, (k / 3) as f64);
    (point.into(), (place * 0.9 + 0.05 + tile) / DVec2::new(3.0, 2.0))
}

/// A print for it: large and small blocks of greys without a pattern.
pub fn blocks() -> Picture {
    let grey = |x: usize, y: usize, seed: usize| (((x * 7919 + y * 104_729 + seed) * 2_654_435_761) >> 9) % 256;
    Picture::from_fn(900, 600, |x, y| {
        [((grey(x / 40, y / 40, 1) * 2 + grey(x / 12, y / 12, 5)) / 3) as u8; 3]
    })
}

/// The box with `cells` x `cells` cells on each side.
pub fn printed_box(cells: usize, texture: Picture) -> Template {
    let (mut vertices, mut texture_coordinates, mut faces) = (Vec::new(), Vec::new(), Vec::new());
    for k in 0..6 {
        let first = vertices.len();
        for i in 0..=cells {
            for j in 0..=cells {
                let (point, uv) = on_side(k, DVec2::new(i as f64, j as f64) / cells as f64);
                vertices.push((point - 0.5) * SIDES);
                texture_coordinates.push(uv);
            }
        }
        for i in 0..cells {
            for j in 0..cells {
                let a = first + i * (cells + 1) + j;
                let [b, c, d] = [a + cells + 1, a + cells + 2, a + 1];
                match k % 2 {
                    0 => faces.extend([[a, c, b], [a, d, c]]),
                    _ => faces.extend([[a, b, c], [a, c, d]]),
                }
            }
        }
    }
    let mesh = TriangleMesh::new(vertices, texture_coordinates, faces).unwrap();
    Template::of_mesh(mesh, texture).unwrap()
}
