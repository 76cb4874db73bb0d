//! Meshes as text: the part of Wavefront OBJ that templates and scans need.

use crate::error::FormatError;
use deepsft_geometry::TriangleMesh;
use deepsft_geometry::glam::{DVec2, DVec3};
use std::fmt::Write;

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

/// Reads what [`mesh_to_obj`] writes: as many texture coordinates as vertices, and faces whose corners name both by one
/// number. For files of other programs there is [`crate::read_scan`].
///
/// # Errors
/// [`FormatError::Obj`] names the line that is not understood; [`FormatError::TemplateFile`] when a corner names
/// different numbers; [`FormatError::Geometry`] when the arrays do not fit together.
pub fn mesh_from_obj(obj: &[u8]) -> Result<TriangleMesh, FormatError> {
    // A file that was cut or damaged is not read as another mesh.
    for (line, text) in (1..).zip(obj.split(|&byte| byte == b'\n')) {
        let mut words = text.split(u8::is_ascii_whitespace).filter(|word| !word.is_empty());
        let ours = match words.next() {
            None => true,
            Some(b"v" | b"f") => words.count() == 3,
            Some(b"vt") => words.count() == 2,
            Some(word) => word.starts_with(b"#"),
        };
        if !ours {
            let reason = "it is no line of a template's mesh".to_owned();
            return Err(FormatError::Obj { line, reason });
        }
    }
    let file = ObjFile::parse(obj)?;
    let mut faces = Vec::new();
    for face in file.groups.iter().flat_map(|group| &group.faces) {
        if face.iter().any(|corner| corner.texture != Some(corner.position)) {
            return Err(FormatError::TemplateFile(
                "its mesh has a corner whose position and texture coordinates have different numbers".to_owned(),
            ));
        }
        faces.push(face.map(|corner| corner.position));
    }
    let vertices = file.positions.iter().map(|&[x, y, z]| DVec3::new(x, -y, -z)).collect();
    let texture_coordinates = file.texture_coordinates.iter().map(|&[u, v]| DVec2::new(u, 1.0 - v));
    Ok(TriangleMesh::new(vertices, texture_coordinates.collect(), faces)?)
}

/// What an OBJ file says of positions, texture coordinates and faces; all else in it is passed over.
#[derive(Debug, Default)]
pub(crate) struct ObjFile {
    pub(crate) positions: Vec<[f64; 3]>,
    /// Those that stand behind positions; as many where each has one.
    pub(crate) colors: Vec<[f64; 3]>,
    pub(crate) texture_coordinates: Vec<[f64; 2]>,
    /// Faces of one object, group and material each; none is empty.
    pub(crate) groups: Vec<ObjGroup>,
    pub(crate) material_files: Vec<String>,
}

#[derive(Clone, Debug, Default)]
pub(crate) struct ObjGroup {
    pub(crate) name: String,
    pub(crate) material: Option<String>,
    /// Triangles; polygons come as fans.
    pub(crate) faces: Vec<[ObjCorner; 3]>,
}

/// Numbers from 0 of a position and of texture coordinates, both of which there are.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ObjCorner {
    pub(crate) position: usize,
    pub(crate) texture: Option<usize>,
}

impl ObjFile {
    pub(crate) fn parse(bytes: &[u8]) -> Result<Self, FormatError> {
        let mut file = Self::default();
        let mut group = ObjGroup::default();
        let mut begun = String::new();
        for (number, line) in (1..).zip(bytes.split(|&byte| byte == b'\n')) {
            let line = begun + String::from_utf8_lossy(line).trim_start_matches('\u{feff}').trim();
            begun = String::new();
            // The line goes on in the next.
            if let Some(first) = line.strip_suffix('\\') {
                begun = format!("{first} ");
                continue;
            }
            let (keyword, rest) = line.split_once(char::is_whitespace).unwrap_or((&line, ""));
            let failure = |reason: String| FormatError::Obj { line: number, reason };
            let missing = |what: &str| failure(format!("{what} expected, not {rest:?}"));
            match keyword {
                "v" => {
                    let position = numbers(rest).ok_or_else(|| missing("a position of three numbers"))?;
                    file.positions.push(position);
                    file.colors.extend(numbers(rest).map(|[_, _, _, r, g, b]| [r, g, b]));
                }
                "vt" => file
                    .texture_coordinates
                    .push(numbers(rest).ok_or_else(|| missing("texture coordinates of two numbers"))?),
                "f" => {
                    let corners: Vec<ObjCorner> =
                        (rest.split_ascii_whitespace().take_while(|word| !word.starts_with('#')))
                            .map(|word| file.corner(word).map_err(failure))
                            .collect::<Result<_, _>>()?;
                    // Points and lines, which some programs write as faces, have no triangles.
                    let fan = corners.windows(2).skip(1).map(|pair| [corners[0], pair[0], pair[1]]);
                    group.faces.extend(fan);
                }
                "mtllib" => file.material_files.push(rest.trim().to_owned()),
                "o" | "g" => file.begin(&mut group, |group| rest.trim().clone_into(&mut group.name)),
                "usemtl" => file.begin(&mut group, |group| group.material = Some(rest.trim().to_owned())),
                _ => {}
            }
        }
        file.begin(&mut group, |_| ());
        Ok(file)
    }

    /// Ends `group` if it has faces, and changes it to the next.
    fn begin(&mut self, group: &mut ObjGroup, change: impl FnOnce(&mut ObjGroup)) {
        if !group.faces.is_empty() {
            self.groups.push(group.clone());
            group.faces.clear();
        }
        change(group);
    }

    /// A corner `position/texture/normal`, of which only the position must be there.
    fn corner(&self, word: &str) -> Result<ObjCorner, String> {
        let mut numbers = word.split('/');
        let mut index = |count: usize, what: &str| -> Result<Option<usize>, String> {
            let Some(number) = numbers.next().filter(|number| !number.is_empty()) else {
                return Ok(None);
            };
            let number: i64 = number
                .parse()
                .map_err(|_| format!("{word:?} is not a corner of a face"))?;
            // From 1, or from the end.
            let index = if number < 0 { count as i64 + number } else { number - 1 };
            match usize::try_from(index) {
                Ok(index) if index < count => Ok(Some(index)),
                _ => Err(format!(
                    "a face names {what} {number}, which is out of bounds: there are {count} before it"
                )),
            }
        };
        let position = index(self.positions.len(), "position")?.ok_or("a corner of a face has no position")?;
        let texture = index(self.texture_coordinates.len(), "texture coordinates")?;
        Ok(ObjCorner { position, texture })
    }
}

/// The first N words as numbers.
pub(crate) fn numbers<const N: usize>(words: &str) -> Option<[f64; N]> {
    let mut words = words.split_ascii_whitespace();
    let mut numbers = [0.0; N];
    for number in &mut numbers {
        *number = words.next()?.parse().ok()?;
    }
    Some(numbers)
}
