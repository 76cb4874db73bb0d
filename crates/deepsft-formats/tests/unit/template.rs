//! Template files.

use deepsft_formats::{FormatError, TEMPLATE_FILE, TemplateFile, encode_png, template_to_files};
use deepsft_geometry::glam::{DVec2, DVec3};
use deepsft_geometry::{Picture, Template, TemplateError, TriangleMesh};

const GOOD: &str = r#"{"format_version":1,"kind":"thin-shell","width_mm":297,"height_mm":210,"texture":"texture.png"}"#;

fn refusal(json: &str) -> String {
    TemplateFile::parse(json.as_bytes()).unwrap_err().to_string()
}

#[test]
fn a_template_comes_back_as_it_was() {
    let texture = Picture::from_fn(30, 21, |x, y| [x as u8, y as u8, 5]);
    let files = template_to_files(&Template::thin_shell(texture, 297.5, 210.25).unwrap()).unwrap();
    let file = TemplateFile::parse(&files[TEMPLATE_FILE]).unwrap();
    let template = file.template(&files[file.texture()], None).unwrap();
    assert_eq!((template.size_mm().x, template.size_mm().y), (297.5, 210.25));
    assert_eq!(template.texture().pixel(29, 20), [29, 20, 5]);
    assert_eq!(files.len(), 2);
}

#[test]
fn a_template_of_a_mesh_comes_back_as_it_was_and_needs_its_mesh() {
    let corners = [
        DVec3::ZERO,
        DVec3::X * 100.5,
        DVec3::new(0.25, 80.0, -1.0 / 3.0),
        DVec3::Z * 60.0,
    ];
    let faces = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]];
    // Each face a chart of its own.
    let vertices = faces.iter().flatten().map(|&v: &usize| corners[v]).collect();
    let chart = |k: usize| [(0.01, 0.1), (0.24, 0.1), (0.1, 0.9)].map(|(u, v)| DVec2::new(u + 0.25 * k as f64, v));
    let uv = (0..4).flat_map(chart).collect();
    let mesh = TriangleMesh::new(vertices, uv, (0..4).map(|k| [3 * k, 3 * k + 1, 3 * k + 2]).collect()).unwrap();
    let template = Template::of_mesh(mesh, Picture::from_fn(16, 8, |x, y| [x as u8, y as u8, 9])).unwrap();
    let files = template_to_files(&template).unwrap();
    let file = TemplateFile::parse(&files[TEMPLATE_FILE]).unwrap();
    let name = file.mesh().unwrap();
    let back = file.template(&files[file.texture()], Some(&files[name])).unwrap();
    assert!(!back.is_sheet());
    assert_eq!(back.mesh().vertices(), template.mesh().vertices());
    assert_eq!(back.mesh().faces(), template.mesh().faces());
    assert_eq!(back.texture().rgb(), template.texture().rgb());
    let refused = file.template(&files[file.texture()], None).unwrap_err();
    assert!(refused.to_string().contains("mesh.obj"), "{refused}");
    let outside = r#"{"format_version":1,"kind":"mesh","mesh":"../m.obj","texture":"t.png"}"#;
    assert!(refusal(outside).contains("own folder"));
}

#[test]
fn a_newer_version_is_called_newer_even_when_its_fields_are_unknown() {
    let newer = r#"{"format_version":2,"rig":"bones.glb"}"#;
    let error = TemplateFile::parse(newer.as_bytes()).unwrap_err();
    assert!(matches!(error, FormatError::TemplateVersion { actual: 2, expected: 1 }));
}

#[test]
fn a_template_without_a_size_is_refused() {
    assert!(refusal(&GOOD.replace("\"width_mm\":297,", "")).contains("missing field `width_mm`"));
    let file = TemplateFile::parse(GOOD.replace("297", "0").as_bytes()).unwrap();
    let texture = encode_png(&Picture::from_fn(2, 2, |_, _| [0; 3])).unwrap();
    let refused = file.template(&texture, None).unwrap_err();
    let FormatError::Template(TemplateError::Size { side, .. }) = refused else {
        panic!("{refused}");
    };
    assert_eq!(side, "width");
}

#[test]
fn a_texture_outside_of_the_folder_and_an_unknown_kind_are_refused() {
    for path in [
        "../secret.png",
        "/etc/passwd",
        "a\\\\b.png",
        "C:x.png",
        "",
        "..",
        ".hidden",
    ] {
        let refused = refusal(&GOOD.replace("texture.png", path));
        assert!(refused.contains("own folder"), "{path}: {refused}");
    }
    assert!(refusal(&GOOD.replace("thin-shell", "volumic")).contains("volumic"));
}
