//! The parts of a Wavefront OBJ file, and the textures that its materials (MTL) name.

use super::{ScanPart, Textures, refused};
use crate::error::FormatError;
use crate::obj::{ObjCorner, ObjFile, ObjGroup};
use deepsft_geometry::glam::{DVec2, DVec3};
use std::collections::HashMap;

/// The parts of an OBJ file, and if they are wanted the textures its materials name.
pub(super) fn parts(bytes: &[u8], textures: &mut Textures<'_>) -> Result<Vec<ScanPart>, FormatError> {
    let file = ObjFile::parse(bytes)?;
    let mut pictures = HashMap::new();
    if textures.are_wanted {
        for name in &file.material_files {
            let mtl = textures
                .file(name)
                .or_else(|error| refused(format!("its material file {name:?}: {error}")))?;
            pictures.extend(diffuse_textures(&mtl));
        }
    }
    let mut parts = Vec::new();
    for group in &file.groups {
        let texture = match group.material.as_ref().and_then(|material| pictures.get(material)) {
            Some(name) => Some(textures.number(name, |textures| {
                // Options may stand before the file's name.
                let last = name.split_ascii_whitespace().last().unwrap_or(name);
                textures.file(name).or_else(|error| {
                    let in_options = (last != name).then(|| textures.file(last).ok()).flatten();
                    in_options.ok_or(error)
                })
            })?),
            None => None,
        };
        parts.push(part(&file, group, texture)?);
    }
    Ok(parts)
}

/// The diffuse textures (`map_Kd`) of an MTL file by their materials' names; all else in it is passed over.
fn diffuse_textures(mtl: &[u8]) -> Vec<(String, String)> {
    let mut textures = Vec::new();
    let mut material = None;
    for line in String::from_utf8_lossy(mtl).lines() {
        match line.trim().split_once(char::is_whitespace) {
            Some(("newmtl", name)) => material = Some(name.trim().to_owned()),
            Some(("map_Kd", name)) => {
                textures.extend(material.clone().map(|material| (material, name.trim().to_owned())))
            }
            _ => {}
        }
    }
    textures
}

/// One vertex for each pair of position and texture coordinates; normals are ours.
fn part(file: &ObjFile, group: &ObjGroup, texture: Option<usize>) -> Result<ScanPart, FormatError> {
    let mut part = ScanPart {
        name: group.name.clone(),
        positions: Vec::new(),
        texture_coordinates: Vec::new(),
        faces: Vec::new(),
        texture,
    };
    let mut known: HashMap<(usize, usize), usize> = HashMap::new();
    for face in &group.faces {
        let mut corners = [0; 3];
        for (corner, ObjCorner { position, texture }) in corners.iter_mut().zip(face) {
            let Some(texture) = texture else {
                return refused(format!(
                    "faces of its part {:?} have no texture coordinates (vt): a template needs them for all",
                    group.name
                ));
            };
            *corner = *known.entry((*position, *texture)).or_insert_with(|| {
                let [x, y, z] = file.positions[*position];
                let [u, v] = file.texture_coordinates[*texture];
                part.positions.push(DVec3::new(x, y, z));
                // OBJ's v points up.
                part.texture_coordinates.push(DVec2::new(u, 1.0 - v));
                part.positions.len() - 1
            });
        }
        part.faces.push(corners);
    }
    Ok(part)
}
