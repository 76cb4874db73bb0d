//! A template whose texture has a seam.

use deepsft_geometry::glam::{DVec2, DVec3};
use deepsft_geometry::{Picture, Template, TriangleMesh};

/// Where the point at `at`, in units of the sheet's sides, is in the texture of [`two_charts`].
pub fn in_texture(at: DVec2) -> DVec2 {
    if at.x > 0.5 { DVec2::new(1.5, 1.0) - at } else { at }
}

/// A sheet of `size_mm` as a mesh. The right half of the texture is turned by half a turn.
pub fn two_charts(texture: Picture, size_mm: DVec2) -> Template {
    let (mut vertices, mut texture_coordinates): (Vec<DVec3>, Vec<DVec2>) = (Vec::new(), Vec::new());
    for (left, turned) in [(0.0, false), (0.5, true)] {
        for (x, y) in [(0.0, 0.0), (0.0, 1.0), (0.5, 1.0), (0.5, 0.0)] {
            let at = DVec2::new(left + x, y);
            vertices.push(((at - 0.5) * size_mm).extend(0.0));
            texture_coordinates.push(if turned { DVec2::new(1.5, 1.0) - at } else { at });
        }
    }
    let faces = vec![[0, 1, 2], [0, 2, 3], [4, 5, 6], [4, 6, 7]];
    let mesh = TriangleMesh::new(vertices, texture_coordinates, faces).unwrap();
    Template::of_mesh(mesh, texture).unwrap()
}
