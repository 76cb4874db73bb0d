//! Picture files to pictures, and back to PNG and JPEG.

use crate::error::FormatError;
use crate::foreign::{check_png, guarded};
use deepsft_geometry::{ImageSize, Picture, check_size};
use image::codecs::jpeg::JpegEncoder;
use image::codecs::png::PngEncoder;
use image::metadata::Orientation;
use image::{
    DynamicImage, ExtendedColorType, ImageDecoder, ImageEncoder, ImageError, ImageFormat, ImageReader, Limits,
    RgbImage, Rgba,
};
use std::io::{Cursor, ErrorKind};
use std::path::Path;

/// Longest side of a picture that is decoded, pixels. JPEG ends at 65,535; a 200-megapixel phone has 16,384.
pub const MAX_PICTURE_SIDE_PX: u32 = 16_384;

/// Most memory the pixels of a picture may take, MiB, as the file has them and as 8-bit RGB: 178 megapixels. Decoders of other kinds than
/// PNG and JPEG hold them more than once.
const MAX_MIB: u64 = 512;
const MAX_OTHER_MIB: u64 = 256;

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

/// Decodes a PNG or JPEG file, and with the feature `pictures` WebP, BMP, TIFF and GIF (its first frame). The picture is turned upright as its EXIF orientation asks,
/// transparent parts become white as on paper, 16-bit values are rounded to 8 bits, grey becomes RGB.
///
/// # Errors
/// [`FormatError::PictureFile`] when the file is empty, of another kind, cut short or corrupt, or larger than
/// [`MAX_PICTURE_SIDE_PX`] or 512 MiB of pixels; nothing of that size is allocated.
pub fn decode_picture(bytes: &[u8]) -> Result<Picture, FormatError> {
    Ok(decode_photograph(bytes)?.0)
}

/// Decodes a picture as [`decode_picture`] does, and tells by how many quarters clockwise it was turned.
///
/// # Errors
/// As [`decode_picture`].
pub fn decode_photograph(bytes: &[u8]) -> Result<(Picture, usize), FormatError> {
    let (decoded, orientation) = decode(bytes, None)?;
    // Last: turning makes a copy, which of three bytes a pixel is the smallest.
    let mut upright = DynamicImage::ImageRgb8(opaque(decoded));
    upright.apply_orientation(orientation);
    let quarters = match orientation {
        Orientation::NoTransforms | Orientation::FlipHorizontal => 0,
        Orientation::Rotate90 | Orientation::Rotate90FlipH => 1,
        Orientation::Rotate180 | Orientation::FlipVertical => 2,
        Orientation::Rotate270 | Orientation::Rotate270FlipH => 3,
    };
    Ok((picture(upright.into_rgb8())?, quarters))
}

/// Decodes a picture as [`decode_picture`] does, but as the sensor has it: its EXIF orientation does not count.
///
/// # Errors
/// As [`decode_picture`].
pub fn decode_as_stored(bytes: &[u8]) -> Result<Picture, FormatError> {
    picture(opaque(decode(bytes, None)?.0))
}

fn picture(rgb: RgbImage) -> Result<Picture, FormatError> {
    let (width, height) = (rgb.width() as usize, rgb.height() as usize);
    Ok(Picture::new(width, height, rgb.into_raw())?)
}

/// 8-bit RGB, transparent parts white.
fn opaque(decoded: DynamicImage) -> RgbImage {
    match decoded.color().has_alpha() {
        true => over_white(decoded),
        false => decoded.into_rgb8(),
    }
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
        return Err(FormatError::picture(
            "it is empty (0 bytes): copy it again from where it came",
        ));
    }
    check_png(bytes).map_err(FormatError::picture)?;
    guarded(|| decode_unguarded(bytes, size)).map_err(FormatError::picture)?
}

fn decode_unguarded(bytes: &[u8], expected: Option<ImageSize>) -> Result<(DynamicImage, Orientation), FormatError> {
    let mut reader = ImageReader::new(Cursor::new(bytes))
        .with_guessed_format()
        .map_err(FormatError::picture)?;
    if reader.format().is_none() {
        return Err(FormatError::picture(unknown_kind(bytes)));
    }
    // The sides are checked here for a clearer message; this bounds what headers and metadata take.
    let max_mib = match reader.format() {
        Some(ImageFormat::Png | ImageFormat::Jpeg) => MAX_MIB,
        _ => MAX_OTHER_MIB,
    };
    let mut limits = Limits::no_limits();
    limits.max_alloc = Some(max_mib << 20);
    reader.limits(limits);
    let mut decoder = reader.into_decoder().map_err(undecodable)?;
    let (width, height) = decoder.dimensions();
    expected.map_or(Ok(()), |size| check_size((width as usize, height as usize), size))?;
    // A file may hold one bit per pixel: what counts is also what becomes of it.
    let rgb_bytes = 3 * u64::from(width) * u64::from(height);
    let mib = decoder.total_bytes().max(rgb_bytes).div_ceil(1 << 20);
    let too_large =
        |limit: String| FormatError::picture(format!("a size of {width} x {height} pixels is too large: {limit}"));
    if width.max(height) > MAX_PICTURE_SIDE_PX {
        return Err(too_large(format!(
            "make it smaller, a side has at most {MAX_PICTURE_SIDE_PX} pixels"
        )));
    }
    if mib > max_mib {
        return Err(too_large(format!(
            "make it smaller, decoded it takes {mib} MiB and at most {max_mib} are read"
        )));
    }
    let orientation = decoder.orientation().map_err(undecodable)?;
    #[cfg(feature = "pictures")]
    crate::foreign::check_jpeg_end(bytes).map_err(FormatError::picture)?;
    let decoded = DynamicImage::from_decoder(decoder).map_err(undecodable)?;
    Ok((decoded, orientation))
}

/// What a decoder says of a file, and what to do.
fn undecodable(error: ImageError) -> FormatError {
    let said = error.to_string();
    let said = said.trim_end_matches('.');
    FormatError::picture(match error {
        ImageError::IoError(error) if error.kind() == ErrorKind::UnexpectedEof => {
            "it was cut short: copy it again from where it came".to_owned()
        }
        ImageError::Unsupported(_) => format!("{said}: save it as PNG or JPEG"),
        ImageError::Limits(_) => format!("{said}: make it smaller"),
        _ => format!("it is damaged ({said}): copy it again from where it came, or save it anew as PNG or JPEG"),
    })
}

/// What a file is that no decoder knows, and what to do.
fn unknown_kind(bytes: &[u8]) -> String {
    let read = [
        ImageFormat::Png,
        ImageFormat::Jpeg,
        ImageFormat::WebP,
        ImageFormat::Tiff,
        ImageFormat::Bmp,
        ImageFormat::Gif,
    ];
    let read = read
        .iter()
        .filter(|format| format.reading_enabled())
        .map(|format| format!("{format:?}").to_uppercase());
    let read = read.collect::<Vec<_>>().join(", ");
    let brand = bytes.get(4..12).and_then(|brand| brand.strip_prefix(b"ftyp"));
    match brand {
        Some(b"avif" | b"avis") => format!("it is AVIF, which is not read: save it as PNG or JPEG ({read} are read)"),
        Some(b"heic" | b"heix" | b"hevc" | b"mif1" | b"msf1") => format!(
            "it is HEIC, which is not read: export it as JPEG (on an iPhone: Settings, Camera, Formats, Most Compatible); {read} are read"
        ),
        _ => format!("it is of no kind that is read: {read}; save it as one of these"),
    }
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
