//! Numbers that differ when templates or pictures do.

use crate::random::mix;
use deepsft_geometry::{Picture, Template};

/// Folds the mesh and the texture of a template into a fingerprint.
pub(crate) fn template_fingerprint(start: u64, template: &Template) -> u64 {
    let mesh = template.mesh();
    let shape = mesh.vertices().iter().flat_map(|p| p.to_array()).map(f64::to_bits);
    let uv = mesh
        .texture_coordinates()
        .iter()
        .flat_map(|uv| uv.to_array())
        .map(f64::to_bits);
    let faces = mesh.faces().iter().flatten().map(|&vertex| vertex as u64);
    let all = shape
        .chain(uv)
        .chain(faces)
        .fold(start, |hash, value| mix(hash ^ value));
    picture_fingerprint(all, template.texture())
}

/// Folds the size and the bytes of a picture into a fingerprint.
pub(crate) fn picture_fingerprint(start: u64, picture: &Picture) -> u64 {
    let size = mix(start ^ mix(picture.width() as u64) ^ picture.height() as u64);
    let word = |bytes: &[u8]| bytes.iter().fold(0, |word: u64, &byte| word << 8 | u64::from(byte));
    picture
        .rgb()
        .chunks(8)
        .fold(size, |hash, bytes| mix(hash ^ word(bytes)))
}
