//! A print laid flat, as files.

use anyhow::Result;
use deepsft::encode_png;
use deepsft_geometry::{FlatPrint, Picture};

/// The files of a flat print by name: the picture, without shading if the template's texture is given, and the confidence in it as grey levels.
pub fn flat_files(flat: &FlatPrint, texture: Option<&Picture>) -> Result<[(&'static str, Vec<u8>); 2]> {
    let unshaded = texture.map(|texture| flat.without_shading(texture));
    let flat = unshaded.as_ref().unwrap_or(flat);
    let (width, height) = (flat.picture.width(), flat.picture.height());
    let level = |x: usize, y: usize| [(255.0 * flat.confidence[y * width + x]).round() as u8; 3];
    Ok([
        ("flat.png", encode_png(&flat.picture)?),
        (
            "flat-confidence.png",
            encode_png(&Picture::from_fn(width, height, level))?,
        ),
    ])
}
