//! Pictures of completed meshes.

use deepsft_geometry::glam::{DQuat, DVec3, Vec3};
use deepsft_geometry::raster::VisibleSurface;
use deepsft_geometry::{Camera, Picture, TriangleMesh};

const GROUND: [u8; 3] = [40, 40, 46];

/// A mesh lit from the camera, both of its sides; `color` says what colour vertex-interpolated `values` have.
pub fn shaded(
    mesh: &TriangleMesh,
    vertices: &[DVec3],
    camera: &Camera,
    values: &[f64],
    color: impl Fn(f64) -> [u8; 3],
) -> Picture {
    let surface = VisibleSurface::new(mesh, vertices, camera);
    let (width, height) = (camera.width() as usize, camera.height() as usize);
    let mut pixels = vec![GROUND; width * height];
    for (index, column, row) in surface.window().pixels() {
        let Some(face) = surface.centres().triangle(index) else {
            continue;
        };
        let Some(triangle) = &surface.triangles()[face] else {
            continue;
        };
        let at = surface.centres().position(column, row);
        let weights = triangle.barycentric(at.x, at.y);
        let value = mesh.faces()[face]
            .iter()
            .zip(weights)
            .map(|(&v, w)| w * values[v])
            .sum();
        let light = 0.35 + 0.65 * triangle.normal(at.x, at.y).dot(Vec3::NEG_Z).abs();
        pixels[row * width + column] = color(value).map(|c| (f32::from(c) * light) as u8);
    }
    Picture::from_fn(width, height, |x, y| pixels[y * width + x])
}

/// `vertices` turned about the vertical through `centre`: seen from the side.
pub fn turned(vertices: &[DVec3], centre: DVec3, angle: f64) -> Vec<DVec3> {
    let turn = DQuat::from_rotation_y(angle);
    vertices.iter().map(|&p| centre + turn * (p - centre)).collect()
}
