//! glTF files that are well made, odd or made to harm.

use deepsft_formats::{FormatError, Scan, Wrap, decode_picture, encode_png, read_scan};
use deepsft_geometry::Picture;
use serde_json::{Value, json};
use std::path::Path;

/// A triangle with a texture, as JSON and its buffer.
fn triangle() -> (Value, Vec<u8>) {
    let positions = [0.0_f32, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0];
    let uv = [0.0_f32, 0.0, 1.0, 0.0, 0.0, 1.0];
    let buffer: Vec<u8> = positions.iter().chain(&uv).flat_map(|x| x.to_le_bytes()).collect();
    let json = json!({
        "asset": {"version": "2.0"},
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0, "TEXCOORD_0": 1}, "material": 0}]}],
        "materials": [{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}],
        "textures": [{"source": 0}],
        "images": [{"uri": "art.png"}],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"},
            {"bufferView": 1, "componentType": 5126, "count": 3, "type": "VEC2"},
        ],
        "bufferViews": [
            {"buffer": 0, "byteOffset": 0, "byteLength": 36},
            {"buffer": 0, "byteOffset": 36, "byteLength": 24},
        ],
        "buffers": [{"byteLength": 60, "uri": "triangle.bin"}],
    });
    (json, buffer)
}

/// What is read of `json` with the triangle's buffer and a picture in the files `triangle.bin` and `picture`.
fn read_with(json: &Value, picture: &str) -> Result<Scan, FormatError> {
    let (_, buffer) = triangle();
    let art = encode_png(&Picture::from_fn(2, 2, |_, _| [9; 3])).unwrap();
    read_scan(
        "a.gltf",
        json.to_string().as_bytes(),
        None,
        &decode_picture,
        &|path: &Path| {
            assert!(path.is_relative(), "{}", path.display());
            match path.to_str() {
                Some("triangle.bin") => Ok(buffer.clone()),
                Some(name) if name == picture => Ok(art.clone()),
                _ => Err(FormatError::File {
                    reason: "there is no such file".into(),
                    path: path.to_path_buf(),
                }),
            }
        },
    )
}

#[test]
fn a_triangle_is_read_without_the_bounds_that_nobody_needs() {
    let scan = read_with(&triangle().0, "art.png").unwrap();
    assert_eq!(scan.parts[0].positions[1].to_array(), [1.0, 0.0, 0.0]);
    assert_eq!(
        (scan.parts[0].faces.as_slice(), scan.parts[0].texture),
        ([[0, 1, 2]].as_slice(), Some(0))
    );
    assert_eq!(scan.mm_per_unit, 1000.0);
}

#[test]
fn names_are_percent_decoded_as_a_whole() {
    let (mut json, _) = triangle();
    json["images"][0]["uri"] = "b%C3%BCste%20%231.png".into();
    assert_eq!(read_with(&json, "b\u{fc}ste #1.png").unwrap().textures.len(), 1);
    json["images"][0]["uri"] = "%FF.png".into();
    assert!(read_with(&json, "art.png").unwrap().notes[0].contains("UTF-8"));
}

#[test]
fn an_image_of_two_textures_is_one_texture() {
    let (mut json, _) = triangle();
    let png = encode_png(&Picture::from_fn(2, 2, |_, _| [9; 3])).unwrap();
    let base64 = base64::Engine::encode(&base64::engine::general_purpose::STANDARD, png);
    json["images"][0]["uri"] = format!("data:image/png;base64,{base64}").into();
    json["textures"] = json!([{"source": 0}, {"source": 0}]);
    let material = |index: u32| json!({"pbrMetallicRoughness": {"baseColorTexture": {"index": index}}});
    json["materials"] = json!([material(0), material(1)]);
    let mut second = json["meshes"][0]["primitives"][0].clone();
    second["material"] = 1.into();
    json["meshes"][0]["primitives"].as_array_mut().unwrap().push(second);
    let scan = read_with(&json, "art.png").unwrap();
    assert_eq!((scan.parts.len(), scan.textures.len()), (2, 1));
}

#[test]
fn files_outside_of_the_folder_are_not_read_whatever_way_they_are_written() {
    for folder in ["/", "../", "%2e%2e/", "a/..%2F..%2F", "C:%5C"] {
        for (list, beside) in [("images", "art.png"), ("buffers", "triangle.bin")] {
            let (mut json, _) = triangle();
            json[list][0]["uri"] = format!("{folder}secret").into();
            // Without a picture it goes on, with a word; without its shape it does not.
            let said = match read_with(&json, "art.png") {
                Ok(scan) if list == "images" => scan.notes.join(""),
                read => read.unwrap_err().to_string(),
            };
            assert!(said.contains("not in its folder"), "{list} {folder}: {said}");
            // The file of that name beside the scan is meant.
            let (mut json, _) = triangle();
            json[list][0]["uri"] = format!("{folder}{beside}").into();
            let scan = read_with(&json, "art.png").unwrap();
            assert!(scan.notes[0].contains("beside it was taken"), "{:?}", scan.notes);
        }
    }
}

#[test]
fn extensions_that_concern_neither_shape_nor_colour_are_passed_over() {
    let (mut json, _) = triangle();
    let plain = read_with(&json, "art.png").unwrap();
    json["extensionsUsed"] = json!(["KHR_materials_unlit"]);
    json["extensionsRequired"] = json!(["KHR_materials_unlit"]);
    json["materials"][0]["extensions"] = json!({"KHR_materials_unlit": {}});
    assert_eq!(read_with(&json, "art.png").unwrap(), plain);
    json["extensionsRequired"] = json!(["KHR_materials_unlit", "KHR_draco_mesh_compression"]);
    let error = read_with(&json, "art.png").unwrap_err().to_string();
    assert!(
        error.contains("KHR_draco_mesh_compression") && error.contains("without compression"),
        "{error}"
    );
}

#[test]
fn colours_of_material_and_vertices_are_multiplied_and_textures_go_on_as_samplers_say() {
    let (mut json, _) = triangle();
    json["samplers"] = json!([{"wrapS": 33648, "wrapT": 33071}]);
    json["textures"][0]["sampler"] = 0.into();
    json["materials"][0]["pbrMetallicRoughness"]["baseColorFactor"] = json!([1.0, 0.5, 0.25, 1.0]);
    // The positions as colours: red at the second vertex, green at the third.
    json["meshes"][0]["primitives"][0]["attributes"]["COLOR_0"] = 0.into();
    let part = read_with(&json, "art.png").unwrap().parts.remove(0);
    assert_eq!((part.texture, part.wraps), (Some(0), [Wrap::Mirror, Wrap::Clamp]));
    // Half of linear light is 188 in sRGB.
    assert_eq!(part.colors, [[0, 0, 0], [255, 0, 0], [0, 188, 0]]);
    // Without a place in its texture it has these colours alone.
    let attributes = json["meshes"][0]["primitives"][0]["attributes"]
        .as_object_mut()
        .unwrap();
    attributes.remove("TEXCOORD_0");
    attributes.remove("COLOR_0");
    let scan = read_with(&json, "art.png").unwrap();
    assert_eq!(
        (scan.parts[0].texture, scan.parts[0].colors.as_slice()),
        (None, [[255, 188, 137]; 3].as_slice())
    );
    assert!(scan.notes[0].contains("took its colour"), "{:?}", scan.notes);
}

#[test]
fn a_texture_that_is_moved_is_where_the_file_says() {
    let read = |transform: Value| {
        let (mut json, _) = triangle();
        json["extensionsRequired"] = json!(["KHR_texture_transform"]);
        json["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"]["extensions"] =
            json!({"KHR_texture_transform": transform});
        let scan = read_with(&json, "art.png").unwrap();
        let rounded = |uv: &deepsft_geometry::glam::DVec2| uv.to_array().map(|x| (1e4 * x).round() / 1e4 + 0.0);
        scan.parts[0]
            .texture_coordinates
            .iter()
            .map(rounded)
            .collect::<Vec<_>>()
    };
    assert_eq!(
        read(json!({"offset": [0, 0], "scale": [1, 1]})),
        [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]
    );
    assert_eq!(
        read(json!({"offset": [0.5, 0.25], "scale": [0.5, 0.25]})),
        [[0.5, 0.25], [1.0, 0.25], [0.5, 0.5]]
    );
    // By a quarter counter-clockwise, v down: along u becomes up.
    assert_eq!(
        read(json!({"offset": [0, 1], "rotation": std::f64::consts::FRAC_PI_2})),
        [[0.0, 1.0], [0.0, 0.0], [1.0, 1.0]]
    );
}

#[test]
fn colours_of_older_materials_are_read_and_what_has_no_place_in_a_texture_is_left_out() {
    let (mut json, _) = triangle();
    json["materials"] =
        json!([{"extensions": {"KHR_materials_pbrSpecularGlossiness": {"diffuseTexture": {"index": 0}}}}]);
    assert_eq!(read_with(&json, "art.png").unwrap().parts[0].texture, Some(0));
    let primitives = json["meshes"][0]["primitives"].as_array_mut().unwrap();
    let (mut lines, mut bare) = (primitives[0].clone(), primitives[0].clone());
    lines["mode"] = 1.into();
    bare["attributes"].as_object_mut().unwrap().remove("TEXCOORD_0");
    primitives.extend([lines, bare]);
    let scan = read_with(&json, "art.png").unwrap();
    assert_eq!((scan.parts.len(), scan.notes.len()), (2, 2), "{:?}", scan.notes);
    assert!(scan.notes[0].contains("triangles") && scan.notes[1].contains("texture coordinates"));
    // The white of a material that says no colour; without a material there is none.
    assert_eq!(scan.parts[1].colors, [[255; 3]; 3]);
    json["meshes"][0]["primitives"][2]
        .as_object_mut()
        .unwrap()
        .remove("material");
    let scan = read_with(&json, "art.png").unwrap();
    assert_eq!(scan.parts.len(), 1);
    assert!(scan.notes[1].contains("left out"), "{:?}", scan.notes);
}

#[test]
fn ten_thousand_primitives_of_one_accessor_do_not_fill_the_memory() {
    let (mut json, _) = triangle();
    let primitive = json["meshes"][0]["primitives"][0].clone();
    json["meshes"][0]["primitives"] = vec![primitive; 10_000].into();
    // Three vertices each are few.
    assert_eq!(read_with(&json, "art.png").unwrap().parts.len(), 10_000);
    // A thousand each are twenty million vertices and texture coordinates.
    let vertices = vec![0; 36_000];
    json["accessors"][0]["count"] = 3000.into();
    json["accessors"][1]["count"] = 3000.into();
    json["bufferViews"][0]["byteLength"] = 36_000.into();
    json["bufferViews"][1] = json!({"buffer": 0, "byteLength": 24_000});
    let read = |json: &Value| {
        read_scan("a.gltf", json.to_string().as_bytes(), None, &decode_picture, &|path| {
            Ok(if path == Path::new("triangle.bin") {
                vertices.clone()
            } else {
                encode_png(&Picture::from_fn(2, 2, |_, _| [9; 3]))?
            })
        })
    };
    // The error alone: to print what was read would take minutes.
    let error = read(&json).err().map(|error| error.to_string());
    assert!(error.is_some_and(|error| error.contains("make it coarser")));
}

#[test]
fn indices_of_what_is_not_there_are_errors_and_no_panics() {
    for pointer in [
        "/scene",
        "/scenes/0/nodes/0",
        "/nodes/0/mesh",
        "/meshes/0/primitives/0/attributes/POSITION",
        "/meshes/0/primitives/0/attributes/TEXCOORD_0",
        "/meshes/0/primitives/0/indices",
        "/meshes/0/primitives/0/material",
        "/materials/0/pbrMetallicRoughness/baseColorTexture/index",
        "/textures/0/source",
        "/accessors/0/bufferView",
        "/bufferViews/0/buffer",
        "/bufferViews/0/byteOffset",
        "/accessors/0/byteOffset",
        "/accessors/0/count",
    ] {
        for number in [61_u64, u64::from(u32::MAX), u64::MAX] {
            let (mut json, _) = triangle();
            let (above, field) = pointer.rsplit_once('/').unwrap();
            match json.pointer_mut(above).unwrap() {
                Value::Array(list) => list[0] = number.into(),
                object => object[field] = number.into(),
            }
            // Of a texture it is a note.
            let said = match read_with(&json, "art.png") {
                Ok(scan) if pointer.contains("exture") => scan.notes.join(""),
                read => read.unwrap_err().to_string(),
            };
            assert!(!said.is_empty(), "{pointer} {number}");
        }
    }
}

#[test]
fn binary_files_that_lie_about_their_lengths_are_errors_and_no_panics() {
    let none = |_: &Path| -> Result<Vec<u8>, FormatError> { panic!("it names no file") };
    for length in [0_u32, 3, 11, 12, 13, u32::MAX] {
        for version in [0_u32, 2] {
            let mut bytes = [b"glTF".as_slice(), &version.to_le_bytes(), &length.to_le_bytes()].concat();
            for _ in 0..3 {
                read_scan("a.glb", &bytes, None, &decode_picture, &none).unwrap_err();
                bytes.extend(length.to_le_bytes());
            }
        }
    }
    read_scan("a.glb", b"glTF", None, &decode_picture, &none).unwrap_err();
}
