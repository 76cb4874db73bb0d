//! Binary glTF 2.0 (`.glb`) with one textured mesh.
//!
//! glTF counts in metres with y up and z towards the viewer; our camera frame counts in millimetres
//! with y down and z away from the viewer. So (x, y, z) becomes (x, -y, -z) / 1000, a half turn about
//! x: the faces keep their side, and a viewer that looks along -z stands where the camera stood.

use deepsft_geometry::TriangleMesh;
use deepsft_geometry::glam::{DVec3, Vec3};
use serde_json::{Value, json};

const ARRAY_BUFFER: u32 = 34962;
const ELEMENT_ARRAY_BUFFER: u32 = 34963;
const FLOAT: u32 = 5126;
const UNSIGNED_INT: u32 = 5125;

/// The bytes of a `.glb` file: `mesh` (mm, camera frame) with smooth normals and `texture_png` on both
/// sides. `deviations` (mm, one a vertex, or none at all) become the attribute `_DEVIATION`. A mesh without faces gives a valid file with
/// an empty scene.
pub fn mesh_to_glb(mesh: &TriangleMesh, texture_png: &[u8], deviations: &[f32]) -> Vec<u8> {
    let mut chunk = BinaryChunk::default();
    let image = chunk.view(texture_png, None);
    if mesh.faces().is_empty() {
        return container(&document(&chunk, image, &Value::Null), &chunk.bytes);
    }
    let position = |&p: &DVec3| (to_gltf(p) / 1000.0).as_vec3();
    let positions: Vec<Vec3> = mesh.vertices().iter().map(position).collect();
    let low = positions.iter().copied().reduce(Vec3::min).unwrap_or_default();
    let high = positions.iter().copied().reduce(Vec3::max).unwrap_or_default();
    let position = chunk.vectors(positions.iter().map(Vec3::to_array));
    chunk.accessors[position]["min"] = json!(low.to_array());
    chunk.accessors[position]["max"] = json!(high.to_array());
    let normals = mesh.normals_at(mesh.vertices());
    let normal = chunk.vectors(normals.iter().map(|n| to_gltf(*n).as_vec3().to_array()));
    let uv = chunk.vectors(mesh.texture_coordinates().iter().map(|uv| uv.as_vec2().to_array()));
    let corners = mesh.faces().as_flattened().iter();
    let corners: Vec<u8> = corners.flat_map(|&v| (v as u32).to_le_bytes()).collect();
    let indices = chunk.accessor(
        &corners,
        ELEMENT_ARRAY_BUFFER,
        json!({"componentType": UNSIGNED_INT, "count": 3 * mesh.faces().len(), "type": "SCALAR"}),
    );
    let mut primitive = json!({
        "attributes": {"POSITION": position, "NORMAL": normal, "TEXCOORD_0": uv},
        "indices": indices,
        "material": 0,
    });
    if !deviations.is_empty() {
        let deviations = deviations.iter().map(|&deviation| [deviation]);
        primitive["attributes"]["_DEVIATION"] = chunk.vectors(deviations).into();
    }
    container(&document(&chunk, image, &primitive), &chunk.bytes)
}

/// The JSON half of the file. `primitive` is null when there is nothing to show.
fn document(chunk: &BinaryChunk, image: usize, primitive: &Value) -> Value {
    let mut document = json!({
        "asset": {"version": "2.0", "generator": concat!("deepsft ", env!("CARGO_PKG_VERSION"))},
        "scene": 0,
        "scenes": [{}],
        "materials": [{
            "pbrMetallicRoughness": {"baseColorTexture": {"index": 0}, "metallicFactor": 0.0, "roughnessFactor": 1.0},
            "doubleSided": true,
        }],
        "textures": [{"source": 0, "sampler": 0}],
        // Linear with mipmaps, clamped at the border of the sheet.
        "samplers": [{"magFilter": 9729, "minFilter": 9987, "wrapS": 33071, "wrapT": 33071}],
        "images": [{"bufferView": image, "mimeType": "image/png"}],
        "bufferViews": chunk.views,
        "buffers": [{"byteLength": chunk.bytes.len()}],
    });
    if !primitive.is_null() {
        document["scenes"] = json!([{"nodes": [0]}]);
        document["nodes"] = json!([{"mesh": 0, "name": "visible surface"}]);
        document["meshes"] = json!([{"primitives": [primitive]}]);
        document["accessors"] = json!(chunk.accessors);
    }
    document
}

/// The file's binary half, with the views and accessors into it.
#[derive(Default)]
struct BinaryChunk {
    bytes: Vec<u8>,
    views: Vec<Value>,
    accessors: Vec<Value>,
}

impl BinaryChunk {
    fn view(&mut self, content: &[u8], target: Option<u32>) -> usize {
        let mut view = json!({"buffer": 0, "byteOffset": self.bytes.len(), "byteLength": content.len()});
        if let Some(target) = target {
            view["target"] = target.into();
        }
        self.views.push(view);
        self.bytes.extend_from_slice(content);
        self.bytes.resize(self.bytes.len().next_multiple_of(4), 0);
        self.views.len() - 1
    }

    /// An accessor of vectors (of N = 1: of numbers), one for each vertex.
    fn vectors<const N: usize>(&mut self, vectors: impl ExactSizeIterator<Item = [f32; N]>) -> usize {
        let kind = ["SCALAR", "VEC2", "VEC3", "VEC4"][N - 1];
        let description = json!({"componentType": FLOAT, "count": vectors.len(), "type": kind});
        let numbers: Vec<u8> = vectors.flatten().flat_map(f32::to_le_bytes).collect();
        self.accessor(&numbers, ARRAY_BUFFER, description)
    }

    fn accessor(&mut self, content: &[u8], target: u32, mut description: Value) -> usize {
        description["bufferView"] = self.view(content, Some(target)).into();
        self.accessors.push(description);
        self.accessors.len() - 1
    }
}

/// The container: a header of 12 bytes, the JSON chunk padded with spaces, the binary chunk with zeros.
fn container(document: &Value, binary: &[u8]) -> Vec<u8> {
    let mut text = document.to_string().into_bytes();
    text.resize(text.len().next_multiple_of(4), b' ');
    let length = 12 + 8 + text.len() + 8 + binary.len();
    let mut bytes = b"glTF".to_vec();
    for number in [2, length as u32, text.len() as u32] {
        bytes.extend(number.to_le_bytes());
    }
    bytes.extend(b"JSON");
    bytes.extend(text);
    bytes.extend((binary.len() as u32).to_le_bytes());
    bytes.extend(b"BIN\0");
    bytes.extend(binary);
    bytes
}

fn to_gltf(p_camera: DVec3) -> DVec3 {
    DVec3::new(p_camera.x, -p_camera.y, -p_camera.z)
}
