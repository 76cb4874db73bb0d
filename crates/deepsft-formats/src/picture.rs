//! Picture files: PNG and JPEG bytes to pictures and back.

use crate::error::FormatError;
use crate::foreign::{check_png, guarded};
use deepsft_geometry::{ImageSize, Picture, check_size};
use image::codecs::jpeg::JpegEncoder;
use image::codecs::png::PngEncoder;
use image::metadata::Orientation;
use image::{
    DynamicImage, ExtendedColorType, ImageDecoder, ImageEncoder, ImageFormat, ImageReader, Limits, RgbImage, Rgba,
};
use std::io::Cursor;
use std::path::Path;

/// Longest side of a picture that is decoded, pixels. JPEG ends at 65,535; a 200-megapixel phone has 16,384.
pub const MAX_PICTURE_SIDE_PX: u32 = 16_384;

/// Most memory the pixels of a picture may take, MiB, as the file has them and as 8-bit RGB: 178 megapixels.
const MAX_MIB: u64 = 512;

/// Whether a file is a picture that is decoded, by the ending of its name.
///
/// ```
/// use deepsft_formats::is_picture;
/// assert!(is_picture("a/b.JPG".as_ref()) && !is_picture("a/png".as_ref()) && !is_picture("clip.mp4".as_ref()));
/// ```
pub fn is_picture(path: &Path) -> bool {
    // Which kinds there are is decided by the features of the crate `image`.
    ImageFormat::from_path(path).is_ok_and(|format| format.reading_enabled())
}

/// Decodes a PNG or JPEG file. The picture is turned upright as its EXIF orientation asks,
/// transparent parts become white as on paper, 16-bit values are rounded to 8 bits, grey becomes RGB.
///
/// # Errors
/// [`FormatError::PictureFile`] when the file is empty, of another kind, cut short or corrupt, or larger than
/// [`MAX_PICTURE_SIDE_PX`] or 512 MiB of pixels; nothing of that size is allocated.
pub fn decode_picture(bytes: &[u8]) -> Result<Picture, FormatError> {
    let (decoded, orientation) = decode(bytes, None)?;
    let rgb = if decoded.color().has_alpha() {
        over_white(decoded)
    } else {
        decoded.into_rgb8()
    };
    // Last: turning makes a copy, which of three bytes a pixel is the smallest.
    let mut upright = DynamicImage::ImageRgb8(rgb);
    upright.apply_orientation(orientation);
    let rgb = upright.into_rgb8();
    let (width, height) = (rgb.width() as usize, rgb.height() as usize);
    Ok(Picture::new(width, height, rgb.into_raw())?)
}

/// Decodes a PNG or JPEG file of a known size as it is stored: its EXIF orientation does not count, transparency and 16-bit values stay.
///
/// # Errors
/// As [`decode_picture`], and before it is decoded when its size is another one.
pub fn decode_image(bytes: &[u8], size: ImageSize) -> Result<DynamicImage, FormatError> {
    Ok(decode(bytes, Some(size))?.0)
}

fn decode(bytes: &[u8], size: Option<ImageSize>) -> Result<(DynamicImage, Orientation), FormatError> {
    if bytes.is_empty() {
        return Err(FormatError::picture("it is empty (0 bytes)"));
    }
    check_png(bytes).map_err(FormatError::picture)?;
    guarded(|| decode_unguarded(bytes, size)).map_err(FormatError::picture)?
}

fn decode_unguarded(bytes: &[u8], expected: Option<ImageSize>) -> Result<(DynamicImage, Orientation), FormatError> {
    let mut reader = ImageReader::new(Cursor::new(bytes))
        .with_guessed_format()
        .map_err(FormatError::picture)?;
    if reader.format().is_none() {
        return Err(FormatError::picture("it is neither PNG nor JPEG"));
    }
    // The sides are checked here for a clearer message; this bounds what headers and metadata take.
    let mut limits = Limits::no_limits();
    limits.max_alloc = Some(MAX_MIB << 20);
    reader.limits(limits);
    let mut decoder = reader.into_decoder().map_err(FormatError::picture)?;
    let (width, height) = decoder.dimensions();
    expected.map_or(Ok(()), |size| check_size((width as usize, height as usize), size))?;
    // A file may hold one bit per pixel: what counts is also what becomes of it.
    let rgb_bytes = 3 * u64::from(width) * u64::from(height);
    let mib = decoder.total_bytes().max(rgb_bytes).div_ceil(1 << 20);
    let too_large =
        |limit: String| FormatError::picture(format!("a size of {width} x {height} pixels is too large: {limit}"));
    if width.max(height) > MAX_PICTURE_SIDE_PX {
        return Err(too_large(format!("a side has at most {MAX_PICTURE_SIDE_PX} pixels")));
    }
    if mib > MAX_MIB {
        return Err(too_large(format!(
            "decoded it takes {mib} MiB, at most {MAX_MIB} are read"
        )));
    }
    let orientation = decoder.orientation().map_err(FormatError::picture)?;
    let decoded = DynamicImage::from_decoder(decoder).map_err(FormatError::picture)?;
    Ok((decoded, orientation))
}

/// The bytes of a PNG file of `picture` (8-bit RGB).
///
/// # Errors
/// [`FormatError::PictureFile`] when the picture is too large for the format (2^31 pixels a side).
pub fn encode_png(picture: &Picture) -> Result<Vec<u8>, FormatError> {
    encode_pixels(picture.rgb(), picture.size(), ExtendedColorType::Rgb8)
}

/// The bytes of a PNG file of row-major pixels; values of 16 bits are in the machine's byte order.
///
/// # Errors
/// [`FormatError::PictureFile`] when there are more or fewer bytes than an image of this size has, or it is too large.
pub fn encode_pixels(pixels: &[u8], size: ImageSize, color: ExtendedColorType) -> Result<Vec<u8>, FormatError> {
    let expected = size.area().saturating_mul(usize::from(color.bits_per_pixel() / 8));
    let actual = pixels.len();
    if actual != expected {
        let reason = format!("it has {actual} bytes, expected {expected}");
        return Err(FormatError::picture(reason));
    }
    let side = |pixels: usize| u32::try_from(pixels).map_err(FormatError::picture);
    let (width, height) = (side(size.width)?, side(size.height)?);
    let mut png = Vec::new();
    let coded = PngEncoder::new(&mut png).write_image(pixels, width, height, color);
    coded.map_err(FormatError::picture).map(|()| png)
}

/// The bytes of a JPEG file of `picture`, of `quality` 1 to 100.
///
/// # Errors
/// [`FormatError::PictureFile`] when the picture is too large for the format (65,535 pixels a side).
pub fn encode_jpeg(picture: &Picture, quality: u8) -> Result<Vec<u8>, FormatError> {
    let mut jpeg = Vec::new();
    let (width, height) = (picture.width() as u32, picture.height() as u32);
    let encoder = JpegEncoder::new_with_quality(&mut jpeg, quality);
    let coded = encoder.write_image(picture.rgb(), width, height, ExtendedColorType::Rgb8);
    coded.map_err(FormatError::picture).map(|()| jpeg)
}

/// The picture on white paper. A large one is not copied before: memory holds it and its RGB.
fn over_white(picture: DynamicImage) -> RgbImage {
    let over = |[color, alpha]: [u8; 2]| {
        let alpha = u32::from(alpha);
        ((u32::from(color) * alpha + 255 * (255 - alpha) + 127) / 255) as u8
    };
    if picture.color().has_color() {
        let rgba = picture.into_rgba8();
        RgbImage::from_fn(rgba.width(), rgba.height(), |x, y| {
            let Rgba([r, g, b, alpha]) = *rgba.get_pixel(x, y);
            image::Rgb([r, g, b].map(|color| over([color, alpha])))
        })
    } else {
        let grey = picture.into_luma_alpha8();
        RgbImage::from_fn(grey.width(), grey.height(), |x, y| {
            image::Rgb([over(grey.get_pixel(x, y).0); 3])
        })
    }
}
