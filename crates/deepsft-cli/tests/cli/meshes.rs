//! Templates that are no sheets: files nobody here made, from import to evaluation.

use crate::common::{Run, deepsft};
use base64::Engine;
use deepsft::{TemplateFile, decode_picture, encode_png};
use deepsft_geometry::glam::{DVec2, DVec3};
use deepsft_geometry::{Picture, Template, Topology};
use serde_json::{Value, json};
use std::fmt::Write;
use std::fs;
use std::path::Path;

/// A picture that is nowhere like itself.
fn art(seed: usize, side: usize) -> Picture {
    let cell = |x: usize, y: usize, k: usize| {
        let mixed = ((x / 4) * 37 + (y / 4) * 91 + k * 57 + seed * 13) * 2_654_435_761;
        (mixed >> 9) as u8
    };
    Picture::from_fn(side, side, |x, y| std::array::from_fn(|k| cell(x, y, k)))
}

/// Rings around the barrel, and faces around a ring.
const RINGS: usize = 12;
const AROUND: usize = 16;

/// A barrel of 12 cm with two lids as an OBJ file in centimetres, y up: the side of one material in quads, cut open along
/// a seam, the lids of another as polygons of 16 corners.
fn barrel_obj() -> String {
    let mut text = "mtllib barrel.mtl\no barrel\n".to_owned();
    let angle = |i: usize| std::f64::consts::TAU * i as f64 / AROUND as f64;
    for j in 0..=RINGS {
        let t = j as f64 / RINGS as f64;
        let radius = 3.0 + 4.0 * t * (1.0 - t);
        for i in 0..AROUND {
            let (s, c) = angle(i).sin_cos();
            writeln!(text, "v {} {} {}", radius * c, 12.0 * t, radius * s).unwrap();
        }
    }
    // The side unrolled: one column of texture coordinates more than of vertices.
    for j in 0..=RINGS {
        for i in 0..=AROUND {
            writeln!(text, "vt {} {}", i as f64 / AROUND as f64, j as f64 / RINGS as f64).unwrap();
        }
    }
    // Two discs, which stay apart in their texture.
    for centre in [0.25, 0.75] {
        for i in 0..AROUND {
            let (s, c) = angle(i).sin_cos();
            writeln!(text, "vt {} {}", centre + 0.22 * c, 0.5 + 0.22 * s).unwrap();
        }
    }
    text += "usemtl side\n";
    let (vertex, uv) = (
        |j: usize, i: usize| j * AROUND + i % AROUND + 1,
        |j: usize, i: usize| j * (AROUND + 1) + i + 1,
    );
    for j in 0..RINGS {
        for i in 0..AROUND {
            // Seen from outside: up, then against the angle (y x radius = -tangent).
            let corners = [(j, i), (j + 1, i), (j + 1, i + 1), (j, i + 1)];
            text += "f";
            corners
                .iter()
                .for_each(|&(j, i)| write!(text, " {}/{}", vertex(j, i), uv(j, i)).unwrap());
            text += "\n";
        }
    }
    text += "usemtl lids\n";
    let lids = (RINGS + 1) * (AROUND + 1) + 1;
    for (lid, ring) in [0, RINGS].into_iter().enumerate() {
        text += "f";
        for k in 0..AROUND {
            let i = if lid == 0 { k } else { AROUND - 1 - k };
            write!(text, " {}/{}", vertex(ring, i), lids + lid * AROUND + i).unwrap();
        }
        text += "\n";
    }
    text
}

const MATERIALS: &str = "newmtl side\nKd 1 1 1\nmap_Kd pictures\\side.png\nnewmtl lids\nmap_Kd pictures/lids.png\n";

fn write_barrel(folder: &Path) {
    fs::create_dir_all(folder.join("pictures")).unwrap();
    fs::write(folder.join("barrel.obj"), barrel_obj()).unwrap();
    fs::write(folder.join("barrel.mtl"), MATERIALS).unwrap();
    fs::write(folder.join("pictures/side.png"), encode_png(&art(1, 256)).unwrap()).unwrap();
    fs::write(folder.join("pictures/lids.png"), encode_png(&art(2, 128)).unwrap()).unwrap();
}

fn read_template(folder: &Path) -> Template {
    let read = |name: &str| fs::read(folder.join(name)).unwrap();
    let file = TemplateFile::parse(&read("template.json")).unwrap();
    let mesh = read(file.mesh().unwrap());
    file.template(&read(file.texture()), Some(&mesh)).unwrap()
}

#[test]
fn a_scan_goes_from_import_to_evaluation_without_touching_code() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    write_barrel(folder);
    let import = deepsft(
        folder,
        &["template", "import", "barrel.obj", "--scale", "10", "--out", "barrel"],
    );
    assert!(
        import.succeeds().stderr.contains("2 textures were put into one"),
        "{import:?}"
    );
    assert!(import.stdout.contains("closed, without holes"), "{}", import.stdout);
    let template = read_template(&folder.join("barrel"));
    // 16 x 12 quads, and two polygons of 16 corners: 384 + 28 triangles.
    assert_eq!(template.mesh().faces().len(), 412);
    let topology = Topology::of(template.mesh()).unwrap();
    // The seam up the side, and around the two lids.
    assert_eq!(
        (topology.genus(), topology.charts, topology.seam_edges),
        (Some(0), 3, 12 + 2 * 16)
    );
    assert!(
        (template.extent_mm() - DVec3::new(80.0, 120.0, 80.0))
            .abs()
            .max_element()
            < 1e-9
    );
    // Every texel of the atlas shows the texel of the file: vertex at ring 6, a quarter around, u = 4 / 16, v up = 1 / 2.
    let p = DVec3::new(0.0, 0.0, -40.0);
    let near = |i: &usize| template.mesh().vertices()[*i].distance(p);
    let found = (0..template.mesh().vertices().len())
        .min_by(|a, b| near(a).total_cmp(&near(b)))
        .unwrap();
    assert!(near(&found) < 1e-9);
    let (uv, texture) = (template.mesh().texture_coordinates()[found], template.texture());
    let texel = uv * texture.size().as_dvec2();
    // The vertex lies on a corner of texels: that to the right and below is (64, 128) in the file.
    let seen = texture.pixel((texel.x + 0.5) as usize, (texel.y + 0.5) as usize);
    assert_eq!(seen, art(1, 256).pixel(64, 128));
    let views = decode_picture(&fs::read(folder.join("barrel/views.png")).unwrap()).unwrap();
    assert_eq!((views.width(), views.height()), (1080, 720));

    deepsft(
        folder,
        &[
            "synth",
            "--template",
            "barrel",
            "--count",
            "8",
            "--seed",
            "3",
            "--out",
            "data",
        ],
    )
    .succeeds();
    deepsft(
        folder,
        &[
            "synth",
            "--template",
            "barrel",
            "--count",
            "8",
            "--seed",
            "3",
            "--out",
            "again",
        ],
    )
    .succeeds();
    let shard = |name: &str| fs::read(folder.join(name).join("shard-000000.tar")).unwrap();
    assert!(shard("data") == shard("again"));
    let train = [
        "train",
        "--template",
        "barrel",
        "--samples",
        "16",
        "--accuracy-frames",
        "8",
        "--out",
        "model",
    ];
    deepsft(folder, &train).succeeds();
    let model: Value = serde_json::from_slice(&fs::read(folder.join("model/model.json")).unwrap()).unwrap();
    // Rest positions: bins for x, y, depth and z.
    assert_eq!(model["network"]["bins"].as_array().map(Vec::len), Some(4));
    assert!(model["files"].get("template/mesh.obj").is_some());
    let eval = [
        "eval",
        "--model",
        "model",
        "--dataset",
        "data",
        "--json",
        "figures.json",
    ];
    deepsft(folder, &eval).succeeds();
    let figures: Value = serde_json::from_slice(&fs::read(folder.join("figures.json")).unwrap()).unwrap();
    assert_eq!(figures["frames"].as_u64(), Some(8));
    deepsft(folder, &[&eval[..], &["--mesh", "fit"]].concat()).succeeds();
}

#[test]
fn a_soft_toy_and_a_printed_tube_are_followed_through_clips_without_training() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    // The toy's size is computed, and differs in the last digit when it was written and read.
    let models = concat!(env!("CARGO_MANIFEST_DIR"), "/../../models");
    let (toy, poster) = (
        format!("{models}/soft-toy/template"),
        format!("{models}/poster-a4/template/texture.png"),
    );
    let around = ["--size-mm", "297x210", "--around-mm", "91.4"];
    let new = [&["template", "new", "--image", &poster, "--out", "tube"], &around[..]].concat();
    let tube = deepsft(folder, &new);
    let size = "template of 91.4 x 210.0 x 91.4 mm";
    assert!(tube.succeeds().stdout.contains(size), "{tube:?}");
    assert!(folder.join("tube/views.png").exists());
    let label = [&["--picture", &poster[..]], &around[..]].concat();
    for (shown, followed) in [(&toy[..], &["--template", &toy][..]), ("tube", &label)] {
        let clip = "--scale 2 --frames 10 --seed 9000001 --out clip";
        let clip: Vec<&str> = ["clip", "--template", shown]
            .into_iter()
            .chain(clip.split(' '))
            .collect();
        deepsft(folder, &clip).succeeds();
        let run = deepsft(folder, &[&["track", "--out", "track"], followed, &["clip"]].concat());
        let told = run.succeeds().stdout.clone() + &run.stderr;
        // The first answer comes four frames late.
        assert!(told.contains("10 frames, found in 6"), "{shown}: {told}");
    }
}

#[test]
fn what_is_wrong_with_a_scan_is_told_with_its_file() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    write_barrel(folder);
    let import = |arguments: &[&str]| -> Run {
        deepsft(
            folder,
            &[&["template", "import"], arguments, &["--out", "out"]].concat(),
        )
    };
    let broken = |from: &str, to: &str| {
        let obj = barrel_obj();
        assert!(obj.contains(from), "{from:?}");
        fs::write(folder.join("broken.obj"), obj.replacen(from, to, 1)).unwrap();
        import(&["broken.obj"])
    };
    broken("mtllib barrel.mtl", "mtllib absent.mtl").fails(3, &["broken.obj", "absent.mtl"]);
    broken("v 3 0 0\n", "v three 0 0\n").fails(3, &["broken.obj", "position"]);
    broken("f 1/1 17/18 18/19 2/2\n", "f 1/1 17/18 999/19 2/2\n").fails(3, &["broken.obj", "out of bounds"]);
    import(&["absent.obj"]).fails(3, &["absent.obj"]);
    import(&["barrel.mtl"]).fails(3, &["barrel.mtl", ".glb"]);
    import(&["barrel.obj", "--texture", "absent.png"]).fails(3, &["absent.png"]);
    import(&["barrel.obj", "--scale", "0"]).fails(2, &["--scale"]);
    fs::remove_file(folder.join("pictures/lids.png")).unwrap();
    let run = import(&["barrel.obj"]);
    assert!(run.succeeds().stderr.contains("lids.png"), "{}", run.stderr);
    fs::remove_dir_all(folder.join("out")).unwrap();
    fs::remove_file(folder.join("pictures/side.png")).unwrap();
    import(&["barrel.obj"]).fails(3, &["barrel.obj", "lids.png", "side.png"]);
    assert!(!folder.join("out").exists());
    write_barrel(folder);
    // One texture for both materials: the lids lie over the side.
    let run = import(&["barrel.obj", "--texture", "pictures/side.png"]);
    let baked = format!("look at what was baked: {}", Path::new("out/texture.png").display());
    for words in ["belongs to several places", &baked] {
        assert!(run.succeeds().stderr.contains(words), "{}", run.stderr);
    }
    // What can be mended or left out is, with a word; so is a texture of another disk, in other letters.
    let mtl = fs::read_to_string(folder.join("barrel.mtl")).unwrap();
    assert!(mtl.contains("pictures\\side.png"));
    fs::copy(folder.join("pictures/side.png"), folder.join("side.png")).unwrap();
    let mtl = mtl.replace("pictures\\side.png", "C:\\me\\Side.PNG");
    fs::write(folder.join("barrel.mtl"), mtl).unwrap();
    let run = import(&["barrel.obj"]);
    assert!(run.succeeds().stderr.contains("beside it was taken"), "{}", run.stderr);
    for (from, to, note) in [
        ("usemtl side\n", "", "what has no texture was left out"),
        ("vt 0.0625 0\n", "vt 1.5 0\n", "its texture is repeated"),
        ("v 3 0 0\n", "v NaN 0 0\n", "no finite numbers"),
        (
            "f 1/1 17/18 18/19 2/2\n",
            "f 2/2 18/19 17/18 1/1\n",
            "2 faces had their fronts on the other side",
        ),
        ("f 1/1 17/18 18/19 2/2\n", "f 1 17 18 2\n", "2 faces of its part"),
    ] {
        let run = broken(from, to);
        assert!(run.succeeds().stderr.contains(note), "{note}: {}", run.stderr);
    }
}

/// A pyramid of four faces, each a chart, as the JSON and the buffer of a glTF file, its texture inside; turned by a node
/// so that its tip, +z in the mesh, points up.
fn pyramid() -> (Value, Vec<u8>) {
    let corners = [
        [-0.1_f32, -0.1, 0.0],
        [0.1, -0.1, 0.0],
        [0.0, 0.1, 0.0],
        [0.0, 0.0, 0.25],
    ];
    let faces = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]];
    let mut buffer = Vec::new();
    for corner in faces.iter().flatten().flat_map(|&v: &usize| corners[v]) {
        buffer.extend(corner.to_le_bytes());
    }
    for k in 0..4_u16 {
        // Normalised 16-bit coordinates.
        for (u, v) in [(600, 3000), (15000, 3000), (600, 60000)] {
            buffer.extend((16384 * k + u).to_le_bytes());
            buffer.extend(u16::to_le_bytes(v));
        }
    }
    buffer.extend(0..12_u8);
    let picture = encode_png(&art(5, 64)).unwrap();
    let start = buffer.len();
    buffer.extend(&picture);
    let half = std::f64::consts::FRAC_1_SQRT_2;
    let json = json!({
        "asset": {"version": "2.0"},
        "scenes": [{"nodes": [0]}],
        "nodes": [{"children": [1], "scale": [2.0, 2.0, 2.0]}, {"mesh": 0, "rotation": [-half, 0.0, 0.0, half]}],
        "meshes": [{"name": "pyramid", "primitives": [
            {"attributes": {"POSITION": 0, "TEXCOORD_0": 1}, "indices": 2, "material": 0}]}],
        "materials": [{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}],
        "textures": [{"source": 0}],
        "images": [{"bufferView": 3, "mimeType": "image/png"}],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": 12, "type": "VEC3"},
            {"bufferView": 1, "componentType": 5123, "normalized": true, "count": 12, "type": "VEC2"},
            {"bufferView": 2, "componentType": 5121, "count": 12, "type": "SCALAR"},
        ],
        "bufferViews": [
            {"buffer": 0, "byteOffset": 0, "byteLength": 144},
            {"buffer": 0, "byteOffset": 144, "byteLength": 48},
            {"buffer": 0, "byteOffset": 192, "byteLength": 12},
            {"buffer": 0, "byteOffset": start, "byteLength": picture.len()},
        ],
        "buffers": [{"byteLength": buffer.len()}],
    });
    (json, buffer)
}

fn glb(json: &Value, buffer: &[u8]) -> Vec<u8> {
    let mut text = json.to_string().into_bytes();
    text.resize(text.len().next_multiple_of(4), b' ');
    let mut buffer = buffer.to_vec();
    buffer.resize(buffer.len().next_multiple_of(4), 0);
    let mut bytes = b"glTF".to_vec();
    let words = |words: &[usize]| {
        words
            .iter()
            .flat_map(|&w| (w as u32).to_le_bytes())
            .collect::<Vec<u8>>()
    };
    bytes.extend(words(&[2, 28 + text.len() + buffer.len(), text.len(), 0x4e4f_534a]));
    bytes.extend(&text);
    bytes.extend(words(&[buffer.len(), 0x004e_4942]));
    bytes.extend(&buffer);
    bytes
}

#[test]
fn gltf_comes_in_upright_in_millimetres_binary_or_as_json() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let (json, buffer) = pyramid();
    fs::write(folder.join("pyramid.glb"), glb(&json, &buffer)).unwrap();
    let mut separate = json.clone();
    let coded = base64::engine::general_purpose::STANDARD.encode(&buffer);
    separate["buffers"][0]["uri"] = format!("data:application/octet-stream;base64,{coded}").into();
    separate["images"][0] = json!({"uri": "my%20art.png"});
    fs::write(folder.join("my art.png"), encode_png(&art(5, 64)).unwrap()).unwrap();
    fs::write(folder.join("pyramid.gltf"), separate.to_string()).unwrap();
    let mut templates = Vec::new();
    for name in ["pyramid.glb", "pyramid.gltf"] {
        deepsft(folder, &["template", "import", name, "--out", "pyramid"]).succeeds();
        templates.push(read_template(&folder.join("pyramid")));
    }
    assert_eq!(templates[0].mesh(), templates[1].mesh());
    assert!(templates[0].texture() == &art(5, 64) && templates[1].texture() == &art(5, 64));
    // 0.2 x 0.25 x 0.2 m, twice as large, its tip on top: y down.
    let mesh = templates[0].mesh();
    assert!(
        (templates[0].extent_mm() - DVec3::new(400.0, 500.0, 400.0))
            .abs()
            .max_element()
            < 1e-3
    );
    let tip = mesh.vertices().iter().min_by(|a, b| a.y.total_cmp(&b.y)).unwrap();
    assert!(tip.distance(DVec3::new(0.0, -250.0, 0.0)) < 1e-3, "{tip}");
    assert_eq!(Topology::of(mesh).unwrap().charts, 4);
    let low = 600.0 / 65535.0;
    assert!((mesh.texture_coordinates()[0].x - low).abs() < 1e-9);
}

#[test]
fn what_is_wrong_with_a_gltf_file_is_told() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let (json, buffer) = pyramid();
    let refused = |change: &dyn Fn(&mut Value), told: &str| {
        let mut json = json.clone();
        change(&mut json);
        fs::write(folder.join("p.glb"), glb(&json, &buffer)).unwrap();
        deepsft(folder, &["template", "import", "p.glb", "--out", "p"]).fails(3, &["p.glb", told]);
    };
    refused(&|j| j["asset"]["version"] = "1.0".into(), "version");
    refused(
        &|j| j["extensionsRequired"] = json!(["KHR_draco_mesh_compression"]),
        "KHR_draco_mesh_compression",
    );
    refused(&|j| j["meshes"][0]["primitives"][0]["mode"] = 1.into(), "triangles");
    refused(
        &|j| j["meshes"][0]["primitives"][0]["attributes"] = json!({"POSITION": 0}),
        "texture coordinates",
    );
    refused(&|j| j["materials"][0] = json!({}), "--texture");
    refused(&|j| j["accessors"][0]["count"] = 13.into(), "cut short");
    let sparse = json!({"count": 1, "indices": {"bufferView": 0, "componentType": 5121}, "values": {"bufferView": 0}});
    refused(&|j| j["accessors"][0]["sparse"] = sparse.clone(), "sparse");
    refused(&|j| j["nodes"][1]["children"] = json!([0]), "no tree");
    refused(
        &|j| j["buffers"][0]["uri"] = json!("../outside.bin"),
        "not in its folder",
    );
    refused(&|j| j["accessors"][0]["count"] = json!(20_000_000), "cut short");
    refused(&|j| j["images"][0] = json!({"uri": "absent.png"}), "absent.png");
    refused(&|j| j["textures"][0] = json!({}), "texture 0");
    let whole = glb(&json, &buffer);
    fs::write(folder.join("short.glb"), &whole[..whole.len() / 2]).unwrap();
    deepsft(folder, &["template", "import", "short.glb", "--out", "p"]).fails(3, &["short.glb"]);
}

/// The side of half a can as an OBJ file in centimetres: a sheet of 4 pi x 6 cm on a radius of 4 cm, its print outside.
fn label_obj() -> String {
    let (columns, rows) = (64, 8);
    let mut text = String::new();
    for j in 0..=rows {
        for i in 0..=columns {
            let (u, v) = (i as f64 / columns as f64, j as f64 / rows as f64);
            let (s, c) = (std::f64::consts::PI * (u - 0.5)).sin_cos();
            writeln!(
                text,
                "v {} {} {}\nvt {u} {}",
                4.0 * s,
                6.0 * (1.0 - v),
                4.0 * c,
                1.0 - v
            )
            .unwrap();
        }
    }
    for (j, i) in (0..rows).flat_map(|j| (0..columns).map(move |i| (j, i))) {
        let corners = [(j, i), (j + 1, i), (j + 1, i + 1), (j, i + 1)];
        text += "f";
        for corner in corners.map(|(j, i)| j * (columns + 1) + i + 1) {
            write!(text, " {corner}/{corner}").unwrap();
        }
        text += "\n";
    }
    text
}

#[test]
fn the_scan_of_a_bent_sheet_becomes_the_template_of_the_flat_one_and_no_other_does() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    write_barrel(folder);
    fs::write(folder.join("label.obj"), label_obj()).unwrap();
    let import = |scan: &str| -> Run {
        let texture = ["--texture", "pictures/side.png"];
        let arguments = ["template", "import", scan, "--scale", "10", "--sheet", "--out", "flat"];
        let texture = if scan == "label.obj" { &texture[..] } else { &[] };
        deepsft(folder, &[&arguments[..], texture].concat())
    };
    import("barrel.obj").fails(3, &["barrel.obj", "closed"]);
    assert!(!folder.join("flat").exists());
    let run = import("label.obj");
    assert!(
        run.succeeds().stdout.contains("flat sheet of 125.7 x 60.0 mm"),
        "{run:?}"
    );
    let read = |name: &str| fs::read(folder.join("flat").join(name)).unwrap();
    let file = TemplateFile::parse(&read("template.json")).unwrap();
    let template = file.template(&read(file.texture()), None).unwrap();
    assert!(template.is_sheet());
    // Chords of 2 mm on a radius of 40 mm are shorter than their arcs by a hundredth of a percent.
    let off = (template.size_mm() - DVec2::new(40.0 * std::f64::consts::PI, 60.0)).abs();
    assert!(off.max_element() < 0.05, "{}", template.size_mm());
}
