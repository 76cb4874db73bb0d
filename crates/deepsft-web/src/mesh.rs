//! Meshes as JavaScript holds them.

use crate::estimate::object;
use deepsft::geometry::{CompletedMaps, TriangleMesh, fitting::FrameFit, glam::DVec3};
use js_sys::{Float32Array, Object, Uint32Array};
use wasm_bindgen::prelude::*;

/// One frame with the whole mesh in it. The arrays belong to JavaScript.
#[wasm_bindgen]
pub struct RawMesh {
    accepted: bool,
    vertices: Float32Array,
    confidence: Float32Array,
    depth: Float32Array,
    registration: Float32Array,
    solve_ms: f64,
}

impl RawMesh {
    /// Copies mesh and maps out of WebAssembly's memory.
    pub fn of_fit(fitted: &FrameFit, solve_ms: f64) -> Self {
        Self {
            accepted: fitted.accepted,
            vertices: positions(&fitted.vertices_camera),
            confidence: fitted.confidence.as_slice().into(),
            depth: fitted.maps.depth().into(),
            registration: fitted.maps.registration().as_flattened().into(),
            solve_ms,
        }
    }

    /// The same of an ARAP completion: an accepted mesh whose confidence is 1 at the vertices that the maps show and 0 at
    /// those that were recovered.
    pub fn of_completion(completed: &CompletedMaps, solve_ms: f64) -> Self {
        let mut confidence = vec![0.0_f32; completed.vertices_camera.len()];
        for &vertex in &completed.visible {
            confidence[vertex] = 1.0;
        }
        Self {
            accepted: true,
            vertices: positions(&completed.vertices_camera),
            confidence: confidence.as_slice().into(),
            depth: completed.maps.depth().into(),
            registration: completed.maps.registration().as_flattened().into(),
            solve_ms,
        }
    }
}

#[wasm_bindgen]
impl RawMesh {
    /// Whether the mesh explains the image better than the finder's maps do.
    #[wasm_bindgen(getter)]
    pub fn accepted(&self) -> bool {
        self.accepted
    }

    /// Vertices of the whole mesh, (x, y, z) each, camera frame, mm.
    #[wasm_bindgen(getter)]
    pub fn vertices(&self) -> Float32Array {
        self.vertices.clone()
    }

    /// How far the image confirms each vertex, 0 to 1.
    #[wasm_bindgen(getter)]
    pub fn confidence(&self) -> Float32Array {
        self.confidence.clone()
    }

    /// Depth as in [`crate::RawEstimate`]: of the mesh where it was accepted, else as it came.
    #[wasm_bindgen(getter)]
    pub fn depth(&self) -> Float32Array {
        self.depth.clone()
    }

    /// Registration as in [`crate::RawEstimate`]: of the mesh where it was accepted, else as it came.
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
