//! The pictures inside data sets and recordings: bytes in and out, errors as the codec has them.

use crate::foreign::{check_png, guarded};
use deepsft_geometry::ImageSize;
use image::codecs::png::PngEncoder;
use image::error::{LimitError, LimitErrorKind};
use image::{DynamicImage, ExtendedColorType, ImageEncoder, ImageError, ImageFormat, ImageReader, ImageResult, Limits};
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

/// The size of a decoded picture.
pub(crate) fn size_of(image: &DynamicImage) -> ImageSize {
    (image.width() as usize, image.height() as usize).into()
}

/// A PNG file of a picture's row-major pixels; values of 16 bits are in the machine's byte order.
pub(crate) fn encode_png(pixels: &[u8], size: ImageSize, color: ExtendedColorType) -> ImageResult<Vec<u8>> {
    let too_long = |_| ImageError::Limits(LimitError::from_kind(LimitErrorKind::DimensionError));
    let side = |pixels: usize| u32::try_from(pixels).map_err(too_long);
    let mut png = Vec::new();
    PngEncoder::new(&mut png).write_image(pixels, side(size.width)?, side(size.height)?, color)?;
    Ok(png)
}
