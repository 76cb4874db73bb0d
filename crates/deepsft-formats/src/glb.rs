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
/// sides. A mesh without faces gives a valid file with an empty scene.
pub fn textured_glb(mesh: &TriangleMesh, texture_png: &[u8]) -> Vec<u8> {
    let mut chunk = BinaryChunk::default();
    let image = chunk.view(texture_png, None);
    if mesh.faces().is_empty() {
        return container(&document(&chunk, image, &Value::Null), &chunk.bytes);
    }
    let positions: Vec<Vec3> = mesh
        .vertices()
        .iter()
        .map(|&p| (to_gltf(p) / 1000.0).as_vec3())
        .collect();
    let low = positions.iter().copied().reduce(Vec3::min).unwrap_or_default();
    let high = positions.iter().copied().reduce(Vec3::max).unwrap_or_default();
    let count = positions.len();
    let position = chunk.accessor(
        &floats(positions.iter().flat_map(Vec3::to_array)),
        ARRAY_BUFFER,
        json!({"componentType": FLOAT, "count": count, "type": "VEC3", "min": low.to_array(), "max": high.to_array()}),
    );
    let normal = chunk.accessor(
        &floats(
            mesh.normals_at(mesh.vertices())
                .into_iter()
                .flat_map(|n| to_gltf(n).as_vec3().to_array()),
        ),
        ARRAY_BUFFER,
        json!({"componentType": FLOAT, "count": count, "type": "VEC3"}),
    );
    let uv = chunk.accessor(
        &floats(mesh.texture_coordinates().iter().flat_map(|uv| uv.as_vec2().to_array())),
        ARRAY_BUFFER,
        json!({"componentType": FLOAT, "count": count, "type": "VEC2"}),
    );
    let corners: Vec<u8> = mesh
        .faces()
        .iter()
        .flatten()
        .flat_map(|&v| (v as u32).to_le_bytes())
        .collect();
    let indices = chunk.accessor(
        &corners,
        ELEMENT_ARRAY_BUFFER,
        json!({"componentType": UNSIGNED_INT, "count": 3 * mesh.faces().len(), "type": "SCALAR"}),
    );
    let primitive = json!({
        "attributes": {"POSITION": position, "NORMAL": normal, "TEXCOORD_0": uv},
        "indices": indices,
        "material": 0,
    });
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
    bytes.extend(
        [2_u32, length as u32, text.len() as u32]
            .into_iter()
            .flat_map(u32::to_le_bytes),
    );
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

fn floats(values: impl Iterator<Item = f32>) -> Vec<u8> {
    values.flat_map(f32::to_le_bytes).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use deepsft_geometry::glam::DVec2;

    fn number(bytes: &[u8], at: usize) -> usize {
        u32::from_le_bytes(bytes[at..at + 4].try_into().unwrap()) as usize
    }

    /// The JSON and the binary half, by the container's own lengths.
    fn halves(bytes: &[u8]) -> (Value, &[u8]) {
        assert_eq!(
            (&bytes[..4], number(bytes, 4), number(bytes, 8)),
            (b"glTF".as_slice(), 2, bytes.len())
        );
        let text = number(bytes, 12);
        let binary = number(bytes, 20 + text);
        assert_eq!(
            (&bytes[16..20], &bytes[24 + text..28 + text]),
            (b"JSON".as_slice(), b"BIN\0".as_slice())
        );
        assert_eq!((text % 4, binary % 4, bytes.len()), (0, 0, 28 + text + binary));
        (
            serde_json::from_slice(&bytes[20..20 + text]).unwrap(),
            &bytes[28 + text..],
        )
    }

    fn read_floats(document: &Value, binary: &[u8], attribute: &str) -> Vec<f32> {
        let accessor = document["meshes"][0]["primitives"][0]["attributes"][attribute]
            .as_u64()
            .unwrap() as usize;
        let view = &document["bufferViews"][document["accessors"][accessor]["bufferView"].as_u64().unwrap() as usize];
        let start = view["byteOffset"].as_u64().unwrap() as usize;
        let end = start + view["byteLength"].as_u64().unwrap() as usize;
        binary[start..end]
            .chunks_exact(4)
            .map(|b| f32::from_le_bytes(b.try_into().unwrap()))
            .collect()
    }

    #[test]
    fn a_triangle_is_turned_up_towards_the_viewer_and_into_metres() {
        // Counter-clockwise seen from the camera: top left, bottom left, top right.
        let vertices = [(-10.0, -20.0), (-10.0, 20.0), (10.0, -20.0)]
            .map(|(x, y)| DVec3::new(x, y, 500.0))
            .to_vec();
        let uv = [(0.0, 0.0), (0.0, 1.0), (1.0, 0.0)]
            .map(|(u, v)| DVec2::new(u, v))
            .to_vec();
        let glb = textured_glb(&TriangleMesh::new(vertices, uv, vec![[0, 1, 2]]).unwrap(), b"not-a-png");
        let (document, binary) = halves(&glb);
        assert_eq!(
            read_floats(&document, binary, "POSITION"),
            [-0.01, 0.02, -0.5, -0.01, -0.02, -0.5, 0.01, 0.02, -0.5]
        );
        assert_eq!(read_floats(&document, binary, "NORMAL")[..3], [0.0, 0.0, 1.0]);
        assert_eq!(
            read_floats(&document, binary, "TEXCOORD_0"),
            [0.0, 0.0, 0.0, 1.0, 1.0, 0.0]
        );
        assert_eq!(document["accessors"][0]["min"], json!([-0.01_f32, -0.02_f32, -0.5_f32]));
        assert_eq!(
            document["buffers"][0]["byteLength"].as_u64().unwrap() as usize,
            binary.len()
        );
        let image = &document["bufferViews"][0];
        assert_eq!(
            (image["byteOffset"].as_u64(), image["byteLength"].as_u64()),
            (Some(0), Some(9))
        );
        assert_eq!(binary[..9], *b"not-a-png");
    }

    #[test]
    fn nothing_to_show_is_a_valid_empty_scene() {
        let glb = textured_glb(&TriangleMesh::new(vec![], vec![], vec![]).unwrap(), b"png!");
        let (document, _) = halves(&glb);
        assert_eq!(document["scenes"], json!([{}]));
        assert!(document.get("meshes").is_none() && document.get("accessors").is_none());
    }
}
