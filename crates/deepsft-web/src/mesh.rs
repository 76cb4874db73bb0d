//! Meshes as JavaScript holds them.

use crate::object::object;
use deepsft::geometry::{Maps, Surface, TriangleMesh, glam::DVec3};
use js_sys::{Float32Array, Object, Uint32Array};
use wasm_bindgen::prelude::*;

/// One frame with the whole mesh in it. The arrays belong to JavaScript.
#[wasm_bindgen]
pub struct RawMesh {
    vertices: Float32Array,
    confidence: Float32Array,
    depth: Float32Array,
    registration: Float32Array,
    solve_ms: f64,
}

impl RawMesh {
    /// Copies a surface, and the maps of it, out of WebAssembly's memory.
    pub fn of(surface: &Surface, maps: &Maps, solve_ms: f64) -> Self {
        Self {
            vertices: positions(&surface.vertices_camera),
            confidence: surface.confidence.as_slice().into(),
            depth: maps.depth().into(),
            registration: maps.registration().as_flattened().into(),
            solve_ms,
        }
    }
}

#[wasm_bindgen]
impl RawMesh {
    /// Vertices of the whole mesh, (x, y, z) each, camera frame, mm.
    #[wasm_bindgen(getter)]
    pub fn vertices(&self) -> Float32Array {
        self.vertices.clone()
    }

    /// How far the image confirms each vertex, 0 to 1; of a completion 1 where the maps show it, else 0.
    #[wasm_bindgen(getter)]
    pub fn confidence(&self) -> Float32Array {
        self.confidence.clone()
    }

    /// Depth of the mesh, as in [`crate::RawEstimate`].
    #[wasm_bindgen(getter)]
    pub fn depth(&self) -> Float32Array {
        self.depth.clone()
    }

    /// Registration of the mesh, as in [`crate::RawEstimate`].
    #[wasm_bindgen(getter)]
    pub fn registration(&self) -> Float32Array {
        self.registration.clone()
    }

    /// Milliseconds it took.
    #[wasm_bindgen(getter, js_name = solveMs)]
    pub fn solve_ms(&self) -> f64 {
        self.solve_ms
    }
}

/// Coordinates of points one after the other.
pub fn positions(points: &[DVec3]) -> Float32Array {
    let flat: Vec<f32> = points.iter().flat_map(|p| p.as_vec3().to_array()).collect();
    flat.as_slice().into()
}

/// What of a mesh no frame changes: a plain object.
pub fn template_mesh(mesh: &TriangleMesh) -> Object {
    let corners: Vec<u32> = mesh.faces().iter().flatten().map(|&vertex| vertex as u32).collect();
    let coordinates: Vec<f32> = mesh
        .texture_coordinates()
        .iter()
        .flat_map(|uv| uv.as_vec2().to_array())
        .collect();
    object([
        ("faces", Uint32Array::from(corners.as_slice()).into()),
        ("textureCoordinates", Float32Array::from(coordinates.as_slice()).into()),
    ])
}
