//! The visible surface as a triangle mesh, out of the maps.

use super::Maps;
use crate::camera::Camera;
use crate::error::TemplateError;
use crate::mesh::TriangleMesh;
use glam::DVec2;

/// Pixels between the vertices of the mesh.
const STEP: usize = 2;

/// Tangent of the largest tilt at which two neighbouring vertices still lie on one sheet of the
/// surface: 84 degrees, as in the metrics. A larger step in depth is an edge where something ends.
const STEEPEST: f64 = 10.0;

/// Triangulates the surface that `maps` of `camera`'s image show, every second pixel a vertex. It is in mm, camera
/// frame, faces counter-clockwise seen from the camera, torn where the depth jumps.
///
/// # Errors
/// [`TemplateError`] when the maps show no surface, as [`TriangleMesh::new`] says.
pub fn visible_surface(maps: &Maps, camera: &Camera) -> Result<TriangleMesh, TemplateError> {
    let (columns, rows) = (maps.size().width.div_ceil(STEP), maps.size().height.div_ceil(STEP));
    let pixel = |i: usize, j: usize| j * STEP * maps.size().width + i * STEP;
    let depth = |(i, j): (usize, usize)| f64::from(maps.depth()[pixel(i, j)]);
    // How much of its depth a step between vertices may rise, mm per mm.
    let jump = STEEPEST * STEP as f64 / camera.focal().min_element();
    let mut index = vec![None; columns * rows];
    let (mut vertices, mut texture_coordinates, mut faces) = (Vec::new(), Vec::new(), Vec::new());
    let mut add = |corners: [(usize, usize); 3]| {
        if corners.iter().any(|&(i, j)| !maps.inside(pixel(i, j))) {
            return;
        }
        let depths = corners.map(depth);
        let near = depths.into_iter().fold(f64::MAX, f64::min);
        let far = depths.into_iter().fold(f64::MIN, f64::max);
        if far - near > jump * near {
            return;
        }
        faces.push(corners.map(|(i, j)| {
            *index[j * columns + i].get_or_insert_with(|| {
                let centre = DVec2::new((i * STEP) as f64 + 0.5, (j * STEP) as f64 + 0.5);
                vertices.push(camera.unproject(centre, depth((i, j))));
                texture_coordinates.push(maps.uv(pixel(i, j)));
                vertices.len() - 1
            })
        }));
    };
    for j in 1..rows {
        for i in 1..columns {
            let [a, b, c, d] = [(i - 1, j - 1), (i, j - 1), (i - 1, j), (i, j)];
            add([a, c, b]);
            add([b, c, d]);
        }
    }
    TriangleMesh::new(vertices, texture_coordinates, faces)
}
