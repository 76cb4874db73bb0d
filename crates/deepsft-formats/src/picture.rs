//! Picture files: PNG and JPEG bytes to pictures and back.

use crate::FormatError;
use deepsft_geometry::Picture;
use image::codecs::png::PngEncoder;
use image::{DynamicImage, ExtendedColorType, ImageDecoder, ImageEncoder, ImageReader, Limits, RgbImage, Rgba};
use std::io::Cursor;

/// Longest side of a picture that is decoded, pixels. JPEG ends at 65,535; a 200-megapixel phone has 16,384.
pub const LONGEST_SIDE: u32 = 16_384;

/// Most memory the pixels of a picture may take, bytes, as the file has them and as 8-bit RGB: 178 megapixels.
const MOST_BYTES: u64 = 512 << 20;

/// Decodes a PNG or JPEG file. The picture is turned upright as its EXIF orientation asks,
/// transparent parts become white as on paper, 16-bit values are rounded to 8 bits, grey becomes RGB.
///
/// # Errors
/// * [`FormatError::PictureFileEmpty`] for a file of 0 bytes.
/// * [`FormatError::PictureTooLarge`] above [`LONGEST_SIDE`] or 512 MiB of pixels; nothing of that
///   size is allocated.
/// * [`FormatError::PictureFile`] when the file is of another kind, cut short or corrupt.
pub fn decode_picture(bytes: &[u8]) -> Result<Picture, FormatError> {
    if bytes.is_empty() {
        return Err(FormatError::PictureFileEmpty);
    }
    let failure = |error: image::ImageError| FormatError::PictureFile {
        reason: error.to_string(),
    };
    let mut reader = ImageReader::new(Cursor::new(bytes))
        .with_guessed_format()
        .map_err(|error| FormatError::PictureFile {
            reason: error.to_string(),
        })?;
    if reader.format().is_none() {
        return Err(FormatError::PictureFile {
            reason: "it is neither PNG nor JPEG".to_owned(),
        });
    }
    // The sides are checked here for a clearer message; this bounds what headers and metadata take.
    let mut limits = Limits::no_limits();
    limits.max_alloc = Some(MOST_BYTES);
    reader.limits(limits);
    let mut decoder = reader.into_decoder().map_err(failure)?;
    let (width, height) = decoder.dimensions();
    // A file may hold one bit per pixel: what counts is also what becomes of it.
    let rgb_bytes = 3 * u64::from(width) * u64::from(height);
    if width.max(height) > LONGEST_SIDE || decoder.total_bytes().max(rgb_bytes) > MOST_BYTES {
        return Err(FormatError::PictureTooLarge {
            width,
            height,
            longest_side: LONGEST_SIDE,
        });
    }
    let orientation = decoder.orientation().map_err(failure)?;
    let mut decoded = DynamicImage::from_decoder(decoder).map_err(failure)?;
    decoded.apply_orientation(orientation);
    let rgb = if decoded.color().has_alpha() {
        over_white(&decoded)
    } else {
        decoded.into_rgb8()
    };
    let (width, height) = (rgb.width() as usize, rgb.height() as usize);
    Ok(Picture::new(width, height, rgb.into_raw())?)
}

/// The bytes of a PNG file of `picture` (8-bit RGB).
///
/// # Errors
/// [`FormatError::PictureFile`] when the picture is too large for the format (2^31 pixels a side).
pub fn encode_png(picture: &Picture) -> Result<Vec<u8>, FormatError> {
    let mut bytes = Vec::new();
    let side = |pixels: usize| {
        u32::try_from(pixels).map_err(|_| FormatError::PictureFile {
            reason: format!("{pixels} pixels on a side"),
        })
    };
    PngEncoder::new(&mut bytes)
        .write_image(
            picture.rgb(),
            side(picture.width())?,
            side(picture.height())?,
            ExtendedColorType::Rgb8,
        )
        .map_err(|error| FormatError::PictureFile {
            reason: error.to_string(),
        })?;
    Ok(bytes)
}

fn over_white(picture: &DynamicImage) -> RgbImage {
    let rgba = picture.to_rgba8();
    RgbImage::from_fn(rgba.width(), rgba.height(), |x, y| {
        let Rgba([r, g, b, alpha]) = *rgba.get_pixel(x, y);
        let alpha = u32::from(alpha);
        image::Rgb([r, g, b].map(|c| ((u32::from(c) * alpha + 255 * (255 - alpha) + 127) / 255) as u8))
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use image::ImageFormat;

    fn encoded(picture: &DynamicImage, format: ImageFormat) -> Vec<u8> {
        let mut bytes = Cursor::new(Vec::new());
        picture.write_to(&mut bytes, format).unwrap();
        bytes.into_inner()
    }

    /// A PNG file that claims to be `width` x `height` and has no pixels: signature and header chunk.
    fn png_header(width: u32, height: u32) -> Vec<u8> {
        let small = encode_png(&Picture::from_fn(1, 1, |_, _| [0; 3])).unwrap();
        let mut header = small[12..29].to_vec();
        header[4..8].copy_from_slice(&width.to_be_bytes());
        header[8..12].copy_from_slice(&height.to_be_bytes());
        let mut bytes = [&small[..12], &header, &small[29..]].concat();
        checked(&mut bytes);
        bytes
    }

    /// Writes the checksum of a PNG file's header chunk: the specification's CRC-32 (reflected polynomial), over the
    /// chunk's type and content.
    fn checked(png: &mut [u8]) {
        let crc = !png[12..29].iter().fold(u32::MAX, |crc, &byte| {
            (0..8).fold(crc ^ u32::from(byte), |crc, _| {
                if crc & 1 == 1 { crc >> 1 ^ 0xEDB8_8320 } else { crc >> 1 }
            })
        });
        png[29..33].copy_from_slice(&crc.to_be_bytes());
    }

    #[test]
    fn a_png_comes_back_as_it_was() {
        let picture = Picture::from_fn(5, 3, |x, y| [x as u8 * 40, y as u8 * 80, 7]);
        assert_eq!(decode_picture(&encode_png(&picture).unwrap()).unwrap(), picture);
    }

    #[test]
    fn a_file_of_no_bytes_is_called_empty() {
        assert!(matches!(decode_picture(&[]), Err(FormatError::PictureFileEmpty)));
    }

    #[test]
    fn a_picture_of_20000_by_20000_pixels_is_refused_before_it_is_decoded() {
        let error = decode_picture(&png_header(20_000, 20_000)).unwrap_err();
        assert!(
            matches!(
                error,
                FormatError::PictureTooLarge {
                    width: 20_000,
                    height: 20_000,
                    ..
                }
            ),
            "{error}"
        );
        assert!(error.to_string().contains("20000 x 20000"), "{error}");
        // 15,000 x 15,000 RGB has short enough sides but 675 million bytes. So has a grey picture of one bit per pixel, whose
        // file and whose decoded bytes are smaller.
        let mut one_bit = png_header(15_000, 15_000);
        one_bit[24..26].copy_from_slice(&[1, 0]);
        checked(&mut one_bit);
        let error = decode_picture(&one_bit).unwrap_err();
        assert!(
            matches!(error, FormatError::PictureTooLarge { width: 15_000, .. }),
            "{error}"
        );
        assert!(matches!(
            decode_picture(&png_header(15_000, 15_000)),
            Err(FormatError::PictureTooLarge { .. })
        ));
    }

    #[test]
    fn a_text_and_a_cut_file_are_refused_with_a_reason() {
        let error = decode_picture(b"not a picture at all").unwrap_err();
        assert!(error.to_string().contains("neither PNG nor JPEG"), "{error}");
        let png = encode_png(&Picture::from_fn(64, 64, |x, y| [(x * y) as u8; 3])).unwrap();
        assert!(matches!(
            decode_picture(&png[..png.len() / 2]),
            Err(FormatError::PictureFile { .. })
        ));
    }

    #[test]
    fn transparent_parts_become_white_and_half_transparent_ones_are_mixed() {
        let rgba = image::RgbaImage::from_fn(2, 1, |x, _| Rgba([0, 100, 200, if x == 0 { 0 } else { 51 }]));
        let picture = decode_picture(&encoded(&DynamicImage::ImageRgba8(rgba), ImageFormat::Png)).unwrap();
        // 51 / 255 = 1/5: 0.2 c + 0.8 * 255.
        assert_eq!([picture.pixel(0, 0), picture.pixel(1, 0)], [[255; 3], [204, 224, 244]]);
    }

    #[test]
    fn a_jpeg_with_an_exif_orientation_is_turned_upright() {
        // 16 x 8, left half dark; orientation 6: the stored image is to be rotated clockwise by 90
        // degrees, so that its left side comes to the top.
        let stored = image::GrayImage::from_fn(16, 8, |x, _| image::Luma([if x < 8 { 20 } else { 220 }]));
        let jpeg = encoded(&DynamicImage::ImageLuma8(stored), ImageFormat::Jpeg);
        let tiff = [
            b"MM\0*".as_slice(),
            &[0, 0, 0, 8, 0, 1, 0x01, 0x12, 0, 3, 0, 0, 0, 1, 0, 6, 0, 0, 0, 0, 0, 0],
        ];
        let exif = [b"Exif\0\0".as_slice(), &tiff.concat()].concat();
        let length = (exif.len() as u16 + 2).to_be_bytes();
        let turned = [&jpeg[..2], &[0xFF, 0xE1], &length, &exif, &jpeg[2..]].concat();
        let picture = decode_picture(&turned).unwrap();
        assert_eq!((picture.width(), picture.height()), (8, 16));
        assert!(picture.pixel(4, 2)[0] < 40 && picture.pixel(4, 13)[0] > 200);
    }
}
