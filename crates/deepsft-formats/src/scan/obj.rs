//! The parts of a Wavefront OBJ file, and the textures that its materials (MTL) name.

use super::{ScanPart, Textures};
use crate::error::FormatError;
use crate::obj::{ObjCorner, ObjFile, ObjGroup, numbers};
use deepsft_geometry::glam::DVec2;
use std::collections::{HashMap, HashSet};

/// The parts of an OBJ file, and if they are wanted the textures its materials name.
pub(super) fn parts(bytes: &[u8], textures: &mut Textures<'_>) -> Result<Vec<ScanPart>, FormatError> {
    let file = ObjFile::parse(bytes)?;
    let materials = match textures.are_wanted {
        true => read_materials(&file.material_files, textures),
        false => HashMap::new(),
    };
    let mut parts = Vec::new();
    let mut bare: Vec<(&str, usize)> = Vec::new();
    for group in &file.groups {
        let material = group.material.as_ref().and_then(|material| materials.get(material));
        let texture = material.and_then(|material| material.picture.as_ref());
        // Two folders may have pictures of one name.
        let texture = texture.and_then(|(folder, name)| {
            let read = |textures: &mut Textures<'_>| picture_file(folder, name, textures);
            textures.number_or_note(&format!("{folder}{name}"), read)
        });
        let color = material.and_then(|material| material.color);
        let (placed, unplaced): (Vec<_>, Vec<_>) =
            (group.faces.iter().copied()).partition(|face| face.iter().all(|corner| corner.texture.is_some()));
        parts.push(part(&file, group, &placed, texture.ok_or(color)));
        // Beside a picture a material's colour says nothing.
        let plain = material.filter(|material| material.picture.is_none());
        let unplaced_part = part(&file, group, &unplaced, Err(plain.and(color)));
        if textures.are_wanted && !unplaced_part.colors.is_empty() {
            parts.push(unplaced_part);
        } else if !unplaced.is_empty() {
            match bare.iter_mut().find(|(name, _)| *name == group.name) {
                Some((_, count)) => *count += unplaced.len(),
                None => bare.push((&group.name, unplaced.len())),
            }
        }
    }
    for (name, count) in bare {
        let part = if name.is_empty() {
            String::new()
        } else {
            format!(" of its part {name:?}")
        };
        let note = format!("{count} faces{part} have no texture coordinates (vt) and were left out");
        textures.notes.push(note);
    }
    Ok(parts)
}

/// What is read of a material.
#[derive(Default)]
struct Material {
    /// The folder of the material file, and what that calls its diffuse picture (`map_Kd`).
    picture: Option<(String, String)>,
    /// Its diffuse colour (`Kd`), sRGB.
    color: Option<[u8; 3]>,
}

/// All materials by their names.
fn read_materials(material_files: &[String], textures: &mut Textures<'_>) -> HashMap<String, Material> {
    let mut materials = HashMap::new();
    let mut known = HashSet::new();
    for line in material_files.iter().filter(|line| known.insert(*line)) {
        // A line is one name, with spaces in it, or several.
        let mut files = Vec::new();
        match textures.file(line) {
            Ok(mtl) => files.push((line.as_str(), mtl)),
            Err(error) => {
                let names = line.split_ascii_whitespace();
                files.extend(names.filter_map(|name| Some((name, textures.file(name).ok()?))));
                if files.is_empty() {
                    textures.notes.push(format!("its material file {line:?}: {error}"));
                }
            }
        }
        for (file, mtl) in files {
            let folder = file.rfind(['/', '\\']).map_or("", |end| &file[..=end]);
            add_materials(&mut materials, folder, &mtl);
        }
    }
    materials
}

/// The bytes of a picture that a material file in `folder` names; options may stand before the name.
fn picture_file(folder: &str, name: &str, textures: &mut Textures<'_>) -> Result<Vec<u8>, FormatError> {
    let last = name.split_ascii_whitespace().last().unwrap_or(name);
    let names = [
        format!("{folder}{name}"),
        name.to_owned(),
        format!("{folder}{last}"),
        last.to_owned(),
    ];
    let mut read = textures.file(&names[0]);
    for other in &names[1..] {
        read = read.or_else(|error| textures.file(other).map_err(|_| error));
    }
    read
}

/// The materials of an MTL file in `folder`; all but their diffuse colours is passed over.
fn add_materials(materials: &mut HashMap<String, Material>, folder: &str, mtl: &[u8]) {
    let mut material: Option<&mut Material> = None;
    for line in String::from_utf8_lossy(mtl).lines() {
        let (keyword, rest) = line.trim().split_once(char::is_whitespace).unwrap_or_default();
        match (keyword.to_ascii_lowercase().as_str(), &mut material) {
            ("newmtl", _) => material = Some(materials.entry(rest.trim().to_owned()).or_default()),
            ("map_kd", Some(material)) => material.picture = Some((folder.to_owned(), rest.trim().to_owned())),
            ("kd", Some(material)) => material.color = numbers(rest).map(srgb),
            _ => {}
        }
    }
}

/// A colour in bytes; some programs write 0 to 255 in place of 0 to 1.
fn srgb(color: [f64; 3]) -> [u8; 3] {
    let is_bytes = color.iter().any(|part| *part > 1.0);
    let scale = if is_bytes { 1.0 } else { 255.0 };
    color.map(|part| (scale * part).round() as u8)
}

/// A part of these faces, with a vertex for each corner; normals are ours. `texture` is its number, or the colour of its material: without a
/// texture the colours of the vertices count, and else that of the material.
fn part(
    file: &ObjFile,
    group: &ObjGroup,
    faces: &[[ObjCorner; 3]],
    texture: Result<usize, Option<[u8; 3]>>,
) -> ScanPart {
    let mut part = ScanPart {
        name: group.name.clone(),
        faces: (0..faces.len())
            .map(|face| [3 * face, 3 * face + 1, 3 * face + 2])
            .collect(),
        texture: texture.ok(),
        ..ScanPart::default()
    };
    let has_colors = file.colors.len() == file.positions.len();
    for corner in faces.as_flattened() {
        part.positions.push(file.positions[corner.position].into());
        let [u, v] = corner.texture.map_or([0.0; 2], |place| file.texture_coordinates[place]);
        // OBJ's v points up.
        part.texture_coordinates.push(DVec2::new(u, 1.0 - v));
        if let Err(color) = texture {
            let of_vertex = has_colors.then(|| srgb(file.colors[corner.position]));
            part.colors.extend(of_vertex.or(color));
        }
    }
    part
}
