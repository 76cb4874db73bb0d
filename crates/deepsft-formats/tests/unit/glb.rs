//! Binary glTF, read back by the specification's layout.

use deepsft_formats::mesh_to_glb;
use deepsft_geometry::TriangleMesh;
use deepsft_geometry::glam::{DVec2, DVec3};
use serde_json::{Value, json};

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
    let glb = mesh_to_glb(
        &TriangleMesh::new(vertices, uv, vec![[0, 1, 2]]).unwrap(),
        b"not-a-png",
        &[1.5, 0.5, 2.0],
    );
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
    assert_eq!(read_floats(&document, binary, "_DEVIATION"), [1.5, 0.5, 2.0]);
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
    let glb = mesh_to_glb(&TriangleMesh::new(vec![], vec![], vec![]).unwrap(), b"png!", &[]);
    let (document, _) = halves(&glb);
    assert_eq!(document["scenes"], json!([{}]));
    assert!(document.get("meshes").is_none() && document.get("accessors").is_none());
}
