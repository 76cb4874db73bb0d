//! Template meshes as OBJ.

use deepsft_formats::{FormatError, mesh_from_obj, mesh_to_obj};
use deepsft_geometry::TemplateError;
use deepsft_geometry::glam::{DVec2, DVec3};

const GOOD: &str = "# a triangle\nv 1 -2 -3.5\nv 4 5 6\nv 7 8 10\n\nvt 0 1\nvt 0.25 0.5\nvt 1 0\nf 1/1 2/2 3/3\n";

#[test]
fn a_triangle_is_read_with_y_z_and_v_turned_over() {
    let mesh = mesh_from_obj(GOOD.as_bytes()).unwrap();
    assert_eq!(mesh.vertices()[0], DVec3::new(1.0, 2.0, 3.5));
    assert_eq!(
        mesh.texture_coordinates(),
        [DVec2::ZERO, DVec2::new(0.25, 0.5), DVec2::ONE]
    );
    assert_eq!(mesh.faces(), [[0, 1, 2]]);
    assert_eq!(mesh_from_obj(mesh_to_obj(&mesh).as_bytes()).unwrap(), mesh);
}

#[test]
fn a_line_that_is_not_understood_is_named() {
    for (from, to, line) in [
        ("v 4 5 6", "v 4 five 6", 3),
        ("v 4 5 6", "v 4 5", 3),
        ("vt 0 1", "vt 0", 6),
        ("f 1/1", "f 0/0", 9),
        ("f 1/1", "f -4/1", 9),
        ("f 1/1", "f 1/-9223372036854775808", 9),
        ("f 1/1", "f one", 9),
        ("f 1/1", "f /1", 9),
        ("3/3", "4/4", 9),
        // A file that was cut in its last line, or damaged.
        ("f 1/1 2/2 3/3", "f 1/1 2/2", 9),
        ("f 1/1 2/2 3/3", "f 1/1 2/2 3/3 1/1", 9),
        ("f 1/1 2/2 3/3", "g 1/1 2/2 3/3", 9),
        ("v 4 5 6", "v 4 5 6 1", 3),
        ("vt 0 1", "vt 0 1 0 0", 6),
        ("# a", "mtllib x.mtl\n#", 1),
    ] {
        let error = mesh_from_obj(GOOD.replace(from, to).as_bytes()).unwrap_err();
        assert!(
            matches!(error, FormatError::Obj { line: l, .. } if l == line),
            "{to}: {error}"
        );
    }
    let different = mesh_from_obj(GOOD.replace("f 1/1", "f 1/2").as_bytes()).unwrap_err();
    assert!(different.to_string().contains("have different numbers"), "{different}");
}

#[test]
fn arrays_that_do_not_fit_together_are_refused() {
    let missing = mesh_from_obj(GOOD.replace("vt 1 0\n", "").replace("f 1/1 2/2 3/3", "").as_bytes()).unwrap_err();
    assert!(matches!(
        missing,
        FormatError::Template(TemplateError::TextureCoordinates { actual: 2, expected: 3 })
    ));
    let nan = mesh_from_obj(GOOD.replace("v 4 5 6", "v 4 NaN 6").as_bytes()).unwrap_err();
    assert!(matches!(nan, FormatError::Template(TemplateError::VertexNotFinite(1))));
}
