//! The parts of a Wavefront OBJ file, and the textures that its materials (MTL) name.

use super::{ScanPart, Textures};
use crate::error::FormatError;
use crate::obj::{ObjCorner, ObjFile, ObjGroup};
use deepsft_geometry::glam::{DVec2, DVec3};
use std::collections::{HashMap, HashSet};

/// The parts of an OBJ file, and if they are wanted the textures its materials name.
pub(super) fn parts(bytes: &[u8], textures: &mut Textures<'_>) -> Result<Vec<ScanPart>, FormatError> {
    let file = ObjFile::parse(bytes)?;
    let mut pictures = HashMap::new();
    if textures.are_wanted {
        pictures = material_pictures(&file.material_files, textures);
    }
    let mut parts = Vec::new();
    for group in &file.groups {
        let texture = match group.material.as_ref().and_then(|material| pictures.get(material)) {
            // Two folders may have pictures of one name.
            Some((folder, name)) => Some(textures.number(&format!("{folder}{name}"), |textures| {
                picture_file(folder, name, textures)
            })?),
            None => None,
        };
        parts.push(part(&file, group, texture, textures));
    }
    Ok(parts)
}

/// The textures of all materials by their names: the folder of the material file, and what that calls the picture.
fn material_pictures(material_files: &[String], textures: &mut Textures<'_>) -> HashMap<String, (String, String)> {
    let mut pictures = HashMap::new();
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
            let named = diffuse_textures(&mtl).into_iter();
            pictures.extend(named.map(|(material, name)| (material, (folder.to_owned(), name))));
        }
    }
    pictures
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

/// The diffuse textures (`map_Kd`) of an MTL file by their materials' names; all else in it is passed over.
fn diffuse_textures(mtl: &[u8]) -> Vec<(String, String)> {
    let mut textures = Vec::new();
    let mut material = None;
    for line in String::from_utf8_lossy(mtl).lines() {
        let (keyword, name) = line.trim().split_once(char::is_whitespace).unwrap_or_default();
        match keyword.to_ascii_lowercase().as_str() {
            "newmtl" => material = Some(name.trim().to_owned()),
            "map_kd" => textures.extend(material.clone().map(|material| (material, name.trim().to_owned()))),
            _ => {}
        }
    }
    textures
}

/// One vertex for each pair of position and texture coordinates; normals are ours. Faces without texture coordinates are left out.
fn part(file: &ObjFile, group: &ObjGroup, texture: Option<usize>, textures: &mut Textures<'_>) -> ScanPart {
    let mut part = ScanPart {
        name: group.name.clone(),
        positions: Vec::new(),
        texture_coordinates: Vec::new(),
        faces: Vec::new(),
        texture,
    };
    let mut known: HashMap<(usize, usize), usize> = HashMap::new();
    for face in &group.faces {
        let [Some(a), Some(b), Some(c)] = face.map(|corner| corner.texture) else {
            continue;
        };
        let vertex = |(ObjCorner { position, .. }, texture): (ObjCorner, usize)| {
            *known.entry((position, texture)).or_insert_with(|| {
                let [x, y, z] = file.positions[position];
                let [u, v] = file.texture_coordinates[texture];
                part.positions.push(DVec3::new(x, y, z));
                // OBJ's v points up.
                part.texture_coordinates.push(DVec2::new(u, 1.0 - v));
                part.positions.len() - 1
            })
        };
        let [d, e, f] = *face;
        part.faces.push([(d, a), (e, b), (f, c)].map(vertex));
    }
    let bare = group.faces.len() - part.faces.len();
    if bare > 0 {
        let name = &group.name;
        textures.notes.push(format!(
            "{bare} faces of its part {name:?} have no texture coordinates (vt) and were left out"
        ));
    }
    part
}
