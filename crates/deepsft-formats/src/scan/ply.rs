//! PLY (Stanford), as text or binary: triangles and polygons with texture coordinates or with colours of their vertices.

use super::{ScanPart, Textures, refused};
use crate::error::FormatError;
use deepsft_geometry::glam::{DVec2, DVec3};
use std::collections::BTreeMap;

/// Most numbers of vertices and faces that are read.
const MAX_NUMBERS: usize = 100_000_000;

/// Names under which programs write texture coordinates and colours of vertices.
const PLACES: [[&str; 2]; 4] = [
    ["s", "t"],
    ["u", "v"],
    ["texture_u", "texture_v"],
    ["texture_s", "texture_t"],
];
const COLORS: [[&str; 3]; 3] = [
    ["red", "green", "blue"],
    ["diffuse_red", "diffuse_green", "diffuse_blue"],
    ["r", "g", "b"],
];

/// The parts of a file, one for each texture that it names in comments `TextureFile`.
pub(super) fn parts(bytes: &[u8], textures: &mut Textures<'_>) -> Result<Vec<ScanPart>, FormatError> {
    let (header, mut numbers) = Header::read(bytes)?;
    let (mut vertices, mut faces) = (Vertices::default(), Vec::new());
    for element in &header.elements {
        match element.name.as_str() {
            "vertex" => vertices = Vertices::read(element, &mut numbers)?,
            "face" => faces = read_faces(element, &mut numbers)?,
            _ => element.rows(&mut numbers, |_| Ok(()))?,
        }
    }
    if faces.is_empty() {
        return refused("it has no faces, as a cloud of points: make a mesh of it in the program that made it");
    }
    let has_places = !vertices.places.is_empty() || faces.iter().any(|face: &Face| !face.places.is_empty());
    if !has_places && !textures.are_wanted {
        return refused("it has no texture coordinates, so a texture cannot be put onto it");
    }
    let mut pictures = Vec::new();
    if textures.are_wanted && has_places {
        for name in &header.textures {
            pictures.push(textures.number_or_note(name, |textures| textures.file(name)));
        }
    }
    let mut parts: BTreeMap<Option<usize>, ScanPart> = BTreeMap::new();
    for face in &faces {
        let texture = pictures.get(face.texture).copied().flatten();
        let part = parts.entry(texture).or_insert_with(|| ScanPart {
            name: "mesh".to_owned(),
            texture,
            ..ScanPart::default()
        });
        let first = part.positions.len();
        for (k, &v) in face.vertices.iter().enumerate() {
            let Some(&position) = vertices.positions.get(v) else {
                let count = vertices.positions.len();
                return refused(format!("a face names vertex {v}, there are {count}: export it again"));
            };
            let place = face.places.get(k).or_else(|| vertices.places.get(v));
            part.positions.push(position);
            part.texture_coordinates.push(place.copied().unwrap_or_default());
            part.colors.extend(vertices.colors.get(v).filter(|_| texture.is_none()));
        }
        // A fan.
        (part.faces).extend((first + 2..part.positions.len()).map(|corner| [first, corner - 1, corner]));
    }
    Ok(parts.into_values().collect())
}

/// The positions of a file's vertices, in its order.
pub(super) fn positions(bytes: &[u8]) -> Result<Vec<DVec3>, FormatError> {
    let (header, mut numbers) = Header::read(bytes)?;
    for element in &header.elements {
        if element.name == "vertex" {
            return Ok(Vertices::read(element, &mut numbers)?.positions);
        }
        element.rows(&mut numbers, |_| Ok(()))?;
    }
    refused("it has no vertices")
}

/// What the vertices say; texture coordinates, v down, and colours are empty or as many as positions.
#[derive(Default)]
struct Vertices {
    positions: Vec<DVec3>,
    places: Vec<DVec2>,
    colors: Vec<[u8; 3]>,
}

impl Vertices {
    fn read(element: &Element, numbers: &mut Numbers<'_>) -> Result<Self, FormatError> {
        let Some(position) = element.named(["x", "y", "z"]) else {
            return refused("its vertices have no positions (x, y, z)");
        };
        let place = PLACES.iter().find_map(|names| element.named(*names));
        let color = COLORS.iter().find_map(|names| element.named(*names));
        // The largest value of a colour.
        let white = color.map_or(1.0, |[red, ..]| element.properties[red].kind.white);
        let mut vertices = Self::default();
        element.rows(numbers, |row| {
            let first = |property: usize| row[property].first().copied().unwrap_or(f64::NAN);
            vertices.positions.push(DVec3::from_array(position.map(first)));
            // t points up.
            (vertices.places).extend(place.map(|[s, t]| DVec2::new(first(s), 1.0 - first(t))));
            (vertices.colors).extend(color.map(|color| color.map(|part| (255.0 * first(part) / white).round() as u8)));
            Ok(())
        })?;
        Ok(vertices)
    }
}

/// A polygon, with the places of its corners in the texture if it has them itself.
struct Face {
    vertices: Vec<usize>,
    places: Vec<DVec2>,
    texture: usize,
}

fn read_faces(element: &Element, numbers: &mut Numbers<'_>) -> Result<Vec<Face>, FormatError> {
    let Some([list]) = element
        .named(["vertex_indices"])
        .or_else(|| element.named(["vertex_index"]))
    else {
        return refused("its faces do not name their vertices (vertex_indices)");
    };
    let (places, texture) = (element.named(["texcoord"]), element.named(["texnumber"]));
    let mut faces = Vec::new();
    element.rows(numbers, |row| {
        let is_index = |number: &f64| *number >= 0.0 && number.fract() == 0.0;
        if !row[list].iter().all(is_index) {
            return refused("a face names its vertices by other than whole numbers from 0");
        }
        let vertices: Vec<usize> = row[list].iter().map(|&number| number as usize).collect();
        let places = places.map_or(&[][..], |[places]| &row[places]).as_chunks::<2>().0;
        // Corners without a place would take one of another.
        let is_placed = places.len() == vertices.len();
        let place = |&[s, t]: &[f64; 2]| DVec2::new(s, 1.0 - t);
        faces.push(Face {
            places: places.iter().filter(|_| is_placed).map(place).collect(),
            texture: texture
                .and_then(|[texture]| row[texture].first().copied())
                .unwrap_or(0.0) as usize,
            vertices,
        });
        Ok(())
    })?;
    Ok(faces)
}

/// What stands before the numbers.
struct Header {
    elements: Vec<Element>,
    /// The files of its textures.
    textures: Vec<String>,
}

struct Element {
    name: String,
    count: usize,
    properties: Vec<Property>,
}

struct Property {
    name: String,
    /// Of the number of values before them, if it is a list.
    length: Option<Kind>,
    kind: Kind,
}

/// A kind of numbers.
#[derive(Clone, Copy)]
struct Kind {
    /// The largest value of a colour.
    white: f64,
    /// Reads a binary one.
    read: fn(&mut Numbers<'_>) -> Result<f64, FormatError>,
}

impl Kind {
    fn named(name: &str) -> Option<Self> {
        macro_rules! kind {
            ($number:ty, $white:expr) => {
                Self {
                    white: $white,
                    read: |numbers| Ok(<$number>::from_le_bytes(numbers.bytes()?).into()),
                }
            };
        }
        Some(match name {
            "char" | "int8" => kind!(i8, 255.0),
            "uchar" | "uint8" => kind!(u8, 255.0),
            "short" | "int16" => kind!(i16, 65_535.0),
            "ushort" | "uint16" => kind!(u16, 65_535.0),
            "int" | "int32" => kind!(i32, 1.0),
            "uint" | "uint32" => kind!(u32, 1.0),
            "float" | "float32" => kind!(f32, 1.0),
            "double" | "float64" => kind!(f64, 1.0),
            _ => return None,
        })
    }
}

impl Header {
    fn read(bytes: &[u8]) -> Result<(Self, Numbers<'_>), FormatError> {
        let mut header = Self {
            elements: Vec::new(),
            textures: Vec::new(),
        };
        let (mut rest, mut form) = (bytes, None);
        loop {
            let Some(end) = rest.iter().position(|&byte| byte == b'\n') else {
                return refused("its header has no end: it is cut short, or no PLY; export it again");
            };
            let line = String::from_utf8_lossy(&rest[..end]).into_owned();
            rest = &rest[end + 1..];
            let words: Vec<&str> = line.split_ascii_whitespace().collect();
            let not_understood = || {
                refused(format!(
                    "a line of its header is not understood: {:?}; export it again",
                    line.trim()
                ))
            };
            match words.as_slice() {
                ["format", "ascii", _] => form = Some(Form::Text),
                ["format", "binary_little_endian", _] => form = Some(Form::LittleEndian),
                ["format", "binary_big_endian", _] => form = Some(Form::BigEndian),
                ["comment", "TextureFile", ..] => {
                    let name = line.split_once("TextureFile").map_or("", |(_, name)| name.trim());
                    header.textures.push(name.to_owned());
                }
                ["element", name, count] => match count.parse() {
                    Ok(count) => header.elements.push(Element {
                        name: (*name).to_owned(),
                        count,
                        properties: Vec::new(),
                    }),
                    Err(_) => return not_understood(),
                },
                ["property", of @ .., name] => {
                    let kinds = match of {
                        [kind] => Kind::named(kind).map(|kind| (None, kind)),
                        ["list", length, kind] => {
                            let length = Kind::named(length);
                            length.and_then(|length| Some((Some(length), Kind::named(kind)?)))
                        }
                        _ => None,
                    };
                    match (kinds, header.elements.last_mut()) {
                        (Some((length, kind)), Some(element)) => element.properties.push(Property {
                            name: (*name).to_owned(),
                            length,
                            kind,
                        }),
                        _ => return not_understood(),
                    }
                }
                ["end_header"] => break,
                ["ply"] | ["comment" | "obj_info", ..] | [] => {}
                _ => return not_understood(),
            }
        }
        let Some(form) = form else {
            return refused("its header names no format (ascii, binary_little_endian or binary_big_endian)");
        };
        let read = 0;
        Ok((header, Numbers { rest, form, read }))
    }
}

impl Element {
    /// The places of properties in a row.
    fn named<const N: usize>(&self, names: [&str; N]) -> Option<[usize; N]> {
        let place = |name: &str| self.properties.iter().position(|property| property.name == name);
        let places: Option<Vec<usize>> = names.into_iter().map(place).collect();
        places?.try_into().ok()
    }

    /// Reads all rows: `each` takes the numbers of each property.
    fn rows(
        &self,
        numbers: &mut Numbers<'_>,
        mut each: impl FnMut(&[Vec<f64>]) -> Result<(), FormatError>,
    ) -> Result<(), FormatError> {
        let mut row: Vec<Vec<f64>> = self.properties.iter().map(|_| Vec::new()).collect();
        // Rows without properties take no bytes.
        let count = if self.properties.is_empty() { 0 } else { self.count };
        for _ in 0..count {
            for (property, values) in self.properties.iter().zip(&mut row) {
                values.clear();
                let length = property.length.map_or(Ok(1.0), |kind| numbers.next(kind))?;
                for _ in 0..length as usize {
                    values.push(numbers.next(property.kind)?);
                }
            }
            each(&row)?;
        }
        Ok(())
    }
}

/// How numbers are written.
#[derive(Clone, Copy, PartialEq)]
enum Form {
    Text,
    LittleEndian,
    BigEndian,
}

/// The numbers of a file, one after another.
struct Numbers<'a> {
    rest: &'a [u8],
    form: Form,
    read: usize,
}

impl Numbers<'_> {
    fn next(&mut self, kind: Kind) -> Result<f64, FormatError> {
        self.read += 1;
        if self.read > MAX_NUMBERS {
            return refused(format!("it has more than {MAX_NUMBERS} numbers: make it coarser"));
        }
        if self.form == Form::Text {
            let word = self.rest.trim_ascii_start();
            let end = word.iter().position(u8::is_ascii_whitespace).unwrap_or(word.len());
            let (word, rest) = word.split_at(end);
            self.rest = rest;
            let number = str::from_utf8(word).ok().and_then(|word| word.parse().ok());
            return number.map_or_else(
                || refused("a number is missing: it is cut short or damaged, copy it again"),
                Ok,
            );
        }
        (kind.read)(self)
    }

    /// The bytes of a binary number, the least first.
    fn bytes<const N: usize>(&mut self) -> Result<[u8; N], FormatError> {
        let Some((bytes, rest)) = self.rest.split_first_chunk::<N>() else {
            return refused("its numbers end too early: it is cut short, copy it again");
        };
        self.rest = rest;
        let mut bytes = *bytes;
        if self.form == Form::BigEndian {
            bytes.reverse();
        }
        Ok(bytes)
    }
}
