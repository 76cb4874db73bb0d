//! Meshes as JavaScript holds them.

use crate::object::object;
use deepsft::geometry::{Maps, Surface, TriangleMesh, glam::DVec3};
use js_sys::{Float32Array, Object, Uint32Array};
use wasm_bindgen::prelude::*;

#[wasm_bindgen(typescript_custom_section)]
const TYPE: &str = r#"
/** The numbers of each vertex of a surface. */
export interface RawSurface {
  /** Places, (x, y, z) each, camera frame, mm. */
  vertices: Float32Array;
  /** How far the image confirms each vertex, 0 to 1; of a completion 1 where the maps show it, else 0. */
  confidence: Float32Array;
  /** Standard deviation of each place, mm, along the direction in which it is least sure; empty where that is not known. */
  deviations: Float32Array;
}
/** One frame with the whole mesh in it. */
export interface RawMesh {
  surface: RawSurface;
  /** Depth and registration of the mesh, as in RawEstimate. */
  depth: Float32Array;
  registration: Float32Array;
  /** Milliseconds it took. */
  solveMs: number;
}
"#;

/// The numbers of each vertex: a plain object, the `RawSurface` of TypeScript. Its arrays belong to JavaScript.
pub fn surface_object(surface: &Surface) -> Object {
    object([
        ("vertices", positions(&surface.vertices_camera).into()),
        ("confidence", Float32Array::from(surface.confidence.as_slice()).into()),
        ("deviations", Float32Array::from(surface.deviations.as_slice()).into()),
    ])
}

/// A surface and its maps: a plain object, the `RawMesh` of TypeScript. Its arrays belong to JavaScript.
pub fn mesh_object(surface: &Surface, maps: &Maps, solve_ms: f64) -> Object {
    let registration = Float32Array::from(maps.registration().as_flattened());
    object([
        ("surface", surface_object(surface).into()),
        ("depth", Float32Array::from(maps.depth()).into()),
        ("registration", registration.into()),
        ("solveMs", solve_ms.into()),
    ])
}

/// Coordinates of points one after the other.
pub fn positions(points: &[DVec3]) -> Float32Array {
    let flat: Vec<f32> = points.iter().flat_map(|p| p.as_vec3().to_array()).collect();
    flat.as_slice().into()
}

/// What of a mesh no frame changes: a plain object.
pub fn template_mesh(mesh: &TriangleMesh) -> Object {
    let corners: Vec<u32> = mesh.faces().iter().flatten().map(|&vertex| vertex as u32).collect();
    let places = mesh.texture_coordinates().iter();
    let coordinates: Vec<f32> = places.flat_map(|uv| uv.as_vec2().to_array()).collect();
    object([
        ("faces", Uint32Array::from(corners.as_slice()).into()),
        ("textureCoordinates", Float32Array::from(coordinates.as_slice()).into()),
    ])
}
