//! The pictures inside data sets and recordings: bytes in and out, errors as the codec has them.

use crate::foreign::{check_png, guarded};
use image::codecs::png::PngEncoder;
use image::{DynamicImage, ExtendedColorType, ImageEncoder, ImageFormat, ImageReader, ImageResult, Limits};
use std::io::Cursor;

/// Longest side of a picture that is decoded, pixels.
const LONGEST_SIDE: u32 = 8192;

/// Decodes a picture of this `format`, or of the one that its first bytes show.
pub(crate) fn decode(bytes: &[u8], format: Option<ImageFormat>) -> ImageResult<DynamicImage> {
    check_png(bytes)?;
    let mut reader = ImageReader::new(Cursor::new(bytes));
    match format {
        Some(format) => reader.set_format(format),
        None => reader = reader.with_guessed_format()?,
    }
    let mut limits = Limits::default();
    limits.max_image_width = Some(LONGEST_SIDE);
    limits.max_image_height = Some(LONGEST_SIDE);
    reader.limits(limits);
    guarded(|| reader.decode())?
}

/// A PNG file of row-major pixels of a picture of (width, height); values of 16 bits are in the machine's byte order.
pub(crate) fn encode_png(pixels: &[u8], (width, height): (u32, u32), color: ExtendedColorType) -> ImageResult<Vec<u8>> {
    let mut png = Vec::new();
    PngEncoder::new(&mut png).write_image(pixels, width, height, color)?;
    Ok(png)
}
