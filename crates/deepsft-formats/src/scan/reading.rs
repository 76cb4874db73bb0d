//! A scan from the bytes of its file, by the ending of its name.

use super::{Scan, Textures, gltf, obj, ply, refused};
use crate::error::FormatError;
use crate::foreign::guarded;
use crate::obj::ObjFile;
use deepsft_geometry::Picture;
use deepsft_geometry::glam::DVec3;
use std::path::Path;

/// Reads a scan from the bytes of its file: OBJ, PLY, glTF or GLB by the ending of `file_name`. `texture`, if given, is that of
/// all parts, whatever the file says. `decode` decodes its pictures ([`crate::decode_picture`]). `beside` reads a file by its path in the
/// scan's folder; no path it is given is absolute or leads out of the folder.
///
/// # Errors
/// [`FormatError::Scan`] says what is wrong with it; errors of `decode` and `beside`.
pub fn read_scan(
    file_name: &str,
    bytes: &[u8],
    texture: Option<Picture>,
    decode: &dyn Fn(&[u8]) -> Result<Picture, FormatError>,
    beside: &dyn Fn(&Path) -> Result<Vec<u8>, FormatError>,
) -> Result<Scan, FormatError> {
    let mut textures = Textures {
        beside,
        decode,
        are_wanted: texture.is_none(),
        named: Vec::new(),
        pictures: Vec::new(),
        notes: Vec::new(),
    };
    if bytes.is_empty() {
        return refused("it is empty (0 bytes): copy it again from where it came");
    }
    let ending = Path::new(file_name).extension().unwrap_or_default();
    let (mut parts, mm_per_unit) = match ending.to_ascii_lowercase().to_str() {
        Some("obj") => (obj::parts(bytes, &mut textures)?, 1.0),
        Some("ply") => (ply::parts(bytes, &mut textures)?, 1.0),
        Some("glb" | "gltf") => {
            let parts = guarded(|| gltf::parts(bytes, &mut textures));
            (parts.or_else(|error| refused(error.to_string()))??, gltf::MM_PER_UNIT)
        }
        _ => return refused("it is none of .obj, .ply, .glb and .gltf: unpack a ZIP first, export other kinds as GLB"),
    };
    let notes = textures.notes;
    let mut textures = textures.pictures;
    if let Some(picture) = texture {
        textures = vec![picture];
        (parts.iter_mut()).for_each(|part| (part.texture, part.colors) = (Some(0), Vec::new()));
    }
    Ok(Scan {
        parts,
        textures,
        mm_per_unit,
        notes,
    })
}

/// Reads the vertices of a mesh from the bytes of its file, OBJ or PLY, with the numbers, the unit and the axes that they have there.
///
/// # Errors
/// [`FormatError::Obj`] or [`FormatError::Scan`] says what is wrong with it.
pub fn mesh_vertices(file_name: &str, bytes: &[u8]) -> Result<Vec<DVec3>, FormatError> {
    let ending = Path::new(file_name).extension().unwrap_or_default();
    match ending.to_ascii_lowercase().to_str() {
        Some("obj") => Ok(ObjFile::parse(bytes)?.positions.into_iter().map(DVec3::from).collect()),
        Some("ply") => ply::positions(bytes),
        _ => refused("it is neither .obj nor .ply: export it as one of them"),
    }
}
