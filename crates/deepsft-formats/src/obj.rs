//! Meshes as text: the part of Wavefront OBJ that templates need.

use crate::FormatError;
use deepsft_geometry::TriangleMesh;
use deepsft_geometry::glam::{DVec2, DVec3};
use std::fmt::Write;
use std::str::FromStr;

/// `mesh` (mm, template frame) as the text of an OBJ file: `v`, `vt` and `f a/a b/b c/c`, all digits of every number.
/// OBJ has y up, the viewer on the +z side and v up, so (x, y, z) stands there as (x, -y, -z) and v as 1 - v: an upright
/// template opens upright in any viewer.
pub fn mesh_to_obj(mesh: &TriangleMesh) -> String {
    let mut text = String::from("# deepsft template mesh, millimetres\n");
    // Writing to a string cannot fail.
    for p in mesh.vertices() {
        let _ = writeln!(text, "v {} {} {}", p.x, -p.y, -p.z);
    }
    for uv in mesh.texture_coordinates() {
        let _ = writeln!(text, "vt {} {}", uv.x, 1.0 - uv.y);
    }
    for face in mesh.faces() {
        let [a, b, c] = face.map(|v| v + 1);
        let _ = writeln!(text, "f {a}/{a} {b}/{b} {c}/{c}");
    }
    text
}

/// Reads what [`mesh_to_obj`] writes: vertices with one texture coordinate each, triangles, comments. For files of other
/// programs there is `deepsft template import`.
///
/// # Errors
/// [`FormatError::TemplateMesh`] names the line that is not understood; [`FormatError::Geometry`] when the arrays do not
/// fit together.
pub fn mesh_from_obj(obj: &[u8]) -> Result<TriangleMesh, FormatError> {
    let (mut vertices, mut texture_coordinates, mut faces) = (Vec::new(), Vec::new(), Vec::new());
    for (number, line) in obj.split(|&byte| byte == b'\n').enumerate() {
        let mut read = || -> Option<()> {
            let mut words = std::str::from_utf8(line).ok()?.split_ascii_whitespace();
            match words.next() {
                None => return Some(()),
                Some(comment) if comment.starts_with('#') => return Some(()),
                Some("v") => {
                    let [x, y, z] = numbers(&mut words)?;
                    vertices.push(DVec3::new(x, -y, -z));
                }
                Some("vt") => {
                    let [u, v] = numbers(&mut words)?;
                    texture_coordinates.push(DVec2::new(u, 1.0 - v));
                }
                Some("f") => {
                    let mut corner = || -> Option<usize> {
                        let (vertex, texture) = words.next()?.split_once('/')?;
                        let vertex: usize = vertex.parse().ok()?;
                        (texture.parse() == Ok(vertex)).then(|| vertex.checked_sub(1)).flatten()
                    };
                    faces.push([corner()?, corner()?, corner()?]);
                }
                Some(_) => return None,
            }
            words.next().is_none().then_some(())
        };
        read().ok_or(FormatError::TemplateMesh { line: number + 1 })?;
    }
    Ok(TriangleMesh::new(vertices, texture_coordinates, faces)?)
}

/// The next N words as numbers.
fn numbers<'a, const N: usize>(words: &mut impl Iterator<Item = &'a str>) -> Option<[f64; N]> {
    let mut numbers = [0.0; N];
    for number in &mut numbers {
        *number = f64::from_str(words.next()?).ok()?;
    }
    Some(numbers)
}

#[cfg(test)]
mod tests {
    use super::*;
    use deepsft_geometry::GeometryError;

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
            ("vt 0 1", "vt 0 1 0 0", 6),
            ("f 1/1", "f 1/2", 9),
            ("f 1/1", "f 0/0", 9),
            ("f 1/1 2/2 3/3", "f 1/1 2/2 3/3 1/1", 9),
            ("# a", "mtllib x.mtl\n#", 1),
        ] {
            let error = mesh_from_obj(GOOD.replace(from, to).as_bytes()).unwrap_err();
            assert!(
                matches!(error, FormatError::TemplateMesh { line: l } if l == line),
                "{to}: {error}"
            );
        }
        let missing = mesh_from_obj(GOOD.replace("vt 1 0\n", "").as_bytes()).unwrap_err();
        assert!(matches!(
            missing,
            FormatError::Geometry(GeometryError::TextureCoordinates { actual: 2, expected: 3 })
        ));
        let far = mesh_from_obj(GOOD.replace("3/3", "4/4").as_bytes()).unwrap_err();
        assert!(matches!(
            far,
            FormatError::Geometry(GeometryError::FaceIndex { vertex: 3, .. })
        ));
        let nan = mesh_from_obj(GOOD.replace("v 4 5 6", "v 4 NaN 6").as_bytes()).unwrap_err();
        assert!(matches!(
            nan,
            FormatError::Geometry(GeometryError::VertexNotFinite { vertex: 1 })
        ));
    }
}
