//! Photographs that the program ffmpeg reads: HEIC and AVIF.

use crate::ffmpeg::{Contents, decoding};
use anyhow::{Result, bail};
use deepsft::{MAX_PICTURE_SIDE_PX, decode_picture};
use deepsft_geometry::Picture;
use std::path::Path;

/// What to do with a file that cannot be read.
const ADVICE: &str = "export it as JPEG (on an iPhone: Settings, Camera, Formats, Most Compatible)";

/// Names of the format at a file's beginning.
const BRANDS: [&[u8]; 7] = [b"heic", b"heix", b"hevc", b"mif1", b"msf1", b"avif", b"avis"];

/// Part of the pixels that a file announces which a whole picture has at least: borders may be cut off, tiles are far smaller.
const WHOLE: f64 = 0.8;

/// Reads the picture in a file's `bytes`, turned upright or as the sensor has it, and by how many quarters clockwise it was turned. `None` where
/// the file is of another kind.
pub fn read(path: &Path, bytes: &[u8], upright: bool) -> Result<Option<(Picture, usize)>> {
    let brand = bytes.get(4..12).and_then(|name| name.strip_prefix(b"ftyp"));
    if !brand.is_some_and(|brand| BRANDS.contains(&brand)) {
        return Ok(None);
    }
    let Some([width, height]) = announced_size(bytes) else {
        bail!("it is HEIC or AVIF without a picture: {ADVICE}");
    };
    if width.max(height) > MAX_PICTURE_SIDE_PX {
        bail!(
            "a size of {width} x {height} pixels is too large: make it smaller, a side has at most {MAX_PICTURE_SIDE_PX} pixels"
        );
    }
    // Which stream is for ffmpeg to choose: newer ones put tiles together then.
    let mut command = decoding(path, upright, "error");
    command.args(["-frames:v", "1", "-pix_fmt", "rgb24"]);
    let Ok(decoded) = command.args(["-c:v", "png", "-f", "image2pipe", "-"]).output() else {
        bail!(
            "it is HEIC or AVIF, which the program ffmpeg reads, and that is not on the PATH: install it, or {ADVICE}"
        );
    };
    let Ok(picture) = decode_picture(&decoded.stdout) else {
        let said = String::from_utf8_lossy(&decoded.stderr);
        let said = said.lines().next().unwrap_or("it gives no picture").trim();
        bail!("it is HEIC or AVIF, and this ffmpeg cannot decode it ({said}): {ADVICE}");
    };
    let pixels = f64::from(width) * f64::from(height);
    if (picture.size().area() as f64) < WHOLE * pixels {
        bail!(
            "this ffmpeg decodes a tile of {} of its {width} x {height} pixels: install ffmpeg 7.1 or newer, or {ADVICE}",
            picture.size()
        );
    }
    let is_turned = (picture.width() > picture.height()) != (width > height) && width != height;
    let quarters = match (upright, Contents::of(path).quarters()) {
        (true, quarters) if (quarters % 2 == 1) == is_turned => quarters,
        _ => usize::from(is_turned),
    };
    Ok(Some((picture, quarters)))
}

/// The largest size in an `ispe` box (ISO/IEC 23008-12, 6.5.3): that of the whole picture, beside those of tiles and thumbnails.
fn announced_size(bytes: &[u8]) -> Option<[u32; 2]> {
    let boxes = bytes.windows(20).filter(|at| at.starts_with(b"\0\0\0\x14ispe\0\0\0\0"));
    let number = |at: &[u8]| at.iter().fold(0, |number, &byte| number << 8 | u32::from(byte));
    let sizes = boxes.map(|at| [number(&at[12..16]), number(&at[16..])]);
    sizes.max_by_key(|[width, height]| u64::from(*width) * u64::from(*height))
}
