//! One hash for everything that is told apart: files, templates, configurations, data sets, checkpoints.

use deepsft_geometry::{Picture, Template};
use serde::Serialize;
use sha2::{Digest, Sha256};

/// The SHA-256 of bytes, in 64 hexadecimal digits.
///
/// ```
/// let expected = "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad"; // FIPS 180-2, B.1
/// assert_eq!(deepsft_formats::sha256(b"abc"), expected);
/// ```
pub fn sha256(bytes: &[u8]) -> String {
    hexadecimal(Sha256::new_with_prefix(bytes))
}

/// The SHA-256 of a file, read piece by piece.
///
/// # Errors
/// [`FormatError::File`](crate::FormatError::File).
#[cfg(feature = "fs")]
pub fn sha256_file(path: &std::path::Path) -> Result<String, crate::error::FormatError> {
    use std::io::Read;
    let hash = || -> std::io::Result<String> {
        let (mut file, mut hash, mut piece) = (std::fs::File::open(path)?, Sha256::new(), Vec::new());
        while file.by_ref().take(1 << 16).read_to_end(&mut piece)? > 0 {
            hash.update(&piece);
            piece.clear();
        }
        Ok(hexadecimal(hash))
    };
    hash().map_err(|error| crate::error::FormatError::unreadable(path, crate::reasons::read_error(error)))
}

/// The SHA-256 of a value's JSON, in 64 hexadecimal digits: the same for equal values, in every version and on every
/// machine. A float counts with all its digits; infinities and NaN all count as `null`.
///
/// ```
/// use deepsft_formats::{fingerprint, sha256};
/// assert_eq!(fingerprint(&(0.1, "a")), sha256(br#"[0.1,"a"]"#));
/// ```
pub fn fingerprint(value: &(impl Serialize + ?Sized)) -> String {
    // A map whose keys are no strings: what JSON cannot say is told apart by what it says of it.
    sha256(&serde_json::to_vec(value).unwrap_or_else(|error| error.to_string().into_bytes()))
}

/// Differs when a template's mesh or texture does.
pub fn template_fingerprint(template: &Template) -> String {
    let mesh = template.mesh();
    let vertices: Vec<[f64; 3]> = mesh.vertices().iter().map(|p| p.to_array()).collect();
    let uv: Vec<[f64; 2]> = mesh.texture_coordinates().iter().map(|uv| uv.to_array()).collect();
    fingerprint(&(vertices, uv, mesh.faces(), picture_fingerprint(template.texture())))
}

/// Differs when a picture's size or a pixel does.
pub fn picture_fingerprint(picture: &Picture) -> String {
    fingerprint(&(picture.width(), picture.height(), sha256(picture.rgb())))
}

fn hexadecimal(hash: Sha256) -> String {
    hash.finalize().iter().map(|byte| format!("{byte:02x}")).collect()
}
