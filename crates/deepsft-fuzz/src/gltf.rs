//! Scans as glTF files, of text and binary.

use crate::files::{join, split};
use crate::obj::read_files;
use crate::{picture, template};
use anyhow::Result;
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use deepsft::encode_png;
use deepsft_formats::mesh_to_glb;
use serde_json::{Value, json};
use std::iter::repeat_n;

/// A `.glb` file as it is; a document and its binary chunk, of which a `.glb` file is made; or a document with a buffer
/// and a picture beside it.
pub(crate) fn read(input: &[u8]) -> Result<()> {
    match split(input).as_slice() {
        [file] => read_files("scan.glb", file, false, &[], &|_| Vec::new()),
        [document, binary] => read_files("scan.glb", &container(document, binary), false, &[], &|_| Vec::new()),
        [document, buffer, texture, ..] => read_files("scan.gltf", document, false, texture, &|path| {
            let is_buffer = path.extension().is_some_and(|ending| ending == "bin");
            if is_buffer { buffer } else { texture }.clone()
        }),
        [] => Ok(()),
    }
}

/// The `.glb` file of a document and its binary chunk.
fn container(document: &[u8], binary: &[u8]) -> Vec<u8> {
    let mut file = Vec::new();
    for (kind, content, fill) in [(b"JSON", document, b' '), (b"BIN\0", binary, 0)] {
        let length = content.len().next_multiple_of(4);
        file.extend((length as u32).to_le_bytes());
        file.extend(kind);
        file.extend(content);
        file.extend(repeat_n(fill, length - content.len()));
    }
    let length = 12 + file.len() as u32;
    [b"glTF", &2_u32.to_le_bytes()[..], &length.to_le_bytes(), &file].concat()
}

/// A document of a triangle whose buffer and picture are named so.
fn document(buffer: Value, picture: Value) -> Vec<u8> {
    let document = json!({
        "asset": {"version": "2.0"},
        "scenes": [{"nodes": [0]}],
        "nodes": [
            {"children": [1], "rotation": [0.0, 0.0, 1.0, 0.0], "scale": [1.0, 2.0, 1.0], "translation": [1.0, 0.0, 0.0]},
            {"mesh": 0, "matrix": [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]},
        ],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0, "TEXCOORD_0": 1}, "indices": 2, "material": 0}]}],
        "materials": [{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}],
        "textures": [{"source": 0}],
        "images": [picture],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"},
            {"bufferView": 1, "componentType": 5123, "normalized": true, "count": 3, "type": "VEC2"},
            {"bufferView": 2, "componentType": 5121, "count": 3, "type": "SCALAR"},
        ],
        "bufferViews": [
            {"buffer": 0, "byteLength": 36},
            {"buffer": 0, "byteOffset": 36, "byteLength": 12, "byteStride": 4},
            {"buffer": 0, "byteOffset": 48, "byteLength": 3},
            {"buffer": 0, "byteOffset": 52, "byteLength": 1000},
        ],
        "buffers": [buffer],
    });
    document.to_string().into_bytes()
}

/// The buffer of [`document`], before the picture.
fn triangle() -> Vec<u8> {
    let positions = [0.0_f32, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0];
    let uv = [0_u16, 0, 6000, 0, 0, 6000];
    let floats = positions.iter().flat_map(|value| value.to_le_bytes());
    floats
        .chain(uv.iter().flat_map(|value| value.to_le_bytes()))
        .chain([0, 1, 2, 0])
        .collect()
}

pub(crate) fn seeds() -> Result<Vec<Vec<u8>>> {
    let texture = encode_png(&picture::small(4, 3))?;
    let buffer = triangle();
    let (beside, within) = (json!({"byteLength": 52, "uri": "a.bin"}), json!({"byteLength": 1052}));
    let whole = [&buffer[..], &texture].concat();
    let whole: Vec<u8> = whole.iter().copied().chain(repeat_n(0, 1052 - whole.len())).collect();
    let data = |kind: &str, content: &[u8]| format!("data:{kind};base64,{}", STANDARD.encode(content));
    let coded = json!({"byteLength": 52, "uri": data("application/octet-stream", &buffer)});
    Ok(vec![
        mesh_to_glb(&template::small_mesh()?, &texture, &[]),
        join(&[
            &document(within, json!({"bufferView": 3, "mimeType": "image/png"})),
            &whole,
        ]),
        join(&[&document(coded, json!({"uri": data("image/png", &texture)})), b"", b""]),
        join(&[&document(beside, json!({"uri": "art%20work.png"})), &buffer, &texture]),
    ])
}
