//! The pictures of an RGB-D recording: colour, 16-bit depth, masks.

use crate::error::FormatError;
use crate::image_codec;
use deepsft_geometry::{Camera, Picture};
use image::codecs::jpeg::JpegEncoder;
use image::{DynamicImage, ExtendedColorType, ImageEncoder};

/// Decodes an 8-bit PNG or JPEG file of the camera's size, as it is stored: no orientation, no transparency.
///
/// # Errors
/// [`FormatError::PictureFile`] when it cannot be decoded or is of another size.
pub fn decode_camera_picture(bytes: &[u8], camera: &Camera) -> Result<Picture, FormatError> {
    let image = decode(bytes, camera)?.into_rgb8();
    let (width, height) = (image.width() as usize, image.height() as usize);
    Ok(Picture::new(width, height, image.into_raw())?)
}

/// Decodes a 16-bit grey PNG file of the camera's size, row-major.
///
/// # Errors
/// [`FormatError::PictureFile`] when it cannot be decoded, is of another size or not 16-bit grey.
pub fn decode_depth_png(bytes: &[u8], camera: &Camera) -> Result<Vec<u16>, FormatError> {
    match decode(bytes, camera)? {
        DynamicImage::ImageLuma16(depth) => Ok(depth.into_raw()),
        other => {
            let reason = format!("a depth picture is 16-bit grey, this one is {:?}", other.color());
            Err(FormatError::PictureFile { reason })
        }
    }
}

fn decode(bytes: &[u8], camera: &Camera) -> Result<DynamicImage, FormatError> {
    let image = image_codec::decode(bytes, None).map_err(FormatError::picture)?;
    let (actual, expected) = (image_codec::size_of(&image), camera.size());
    if actual != expected {
        let reason = format!("it has {actual} pixels, its camera {expected}");
        return Err(FormatError::picture(reason));
    }
    Ok(image)
}

/// A depth picture as a 16-bit grey PNG file; `raw` is row-major, as large as the camera's image.
///
/// # Errors
/// [`FormatError::Entry`] when `raw` is of another size, [`FormatError::EntryPicture`] from the codec.
pub fn encode_depth_png(raw: &[u16], camera: &Camera) -> Result<Vec<u8>, FormatError> {
    let bytes: Vec<u8> = raw.iter().flat_map(|units| units.to_ne_bytes()).collect();
    encode_png(&bytes, camera, ExtendedColorType::L16, "depth picture")
}

/// A mask as an 8-bit grey PNG file, 255 on the object; `mask` is row-major, as large as the camera's image.
///
/// # Errors
/// [`FormatError::Entry`] when `mask` is of another size, [`FormatError::EntryPicture`] from the codec.
pub fn encode_mask_png(mask: &[bool], camera: &Camera) -> Result<Vec<u8>, FormatError> {
    let bytes: Vec<u8> = mask.iter().map(|&inside| if inside { 255 } else { 0 }).collect();
    encode_png(&bytes, camera, ExtendedColorType::L8, "mask")
}

fn encode_png(bytes: &[u8], camera: &Camera, color: ExtendedColorType, name: &str) -> Result<Vec<u8>, FormatError> {
    let expected = usize::from(color.bits_per_pixel() / 8).saturating_mul(camera.size().area());
    if bytes.len() != expected {
        let reason = format!("is {} bytes, expected the camera's {expected}", bytes.len());
        return Err(FormatError::entry(name, reason));
    }
    let name = name.to_owned();
    image_codec::encode_png(bytes, camera.size(), color).map_err(|source| FormatError::EntryPicture { name, source })
}

/// A picture as a JPEG file of `quality` 1 to 100.
///
/// # Errors
/// [`FormatError::EntryPicture`] from the codec.
pub fn encode_jpeg(picture: &Picture, quality: u8) -> Result<Vec<u8>, FormatError> {
    let mut coded = Vec::new();
    JpegEncoder::new_with_quality(&mut coded, quality)
        .write_image(
            picture.rgb(),
            picture.width() as u32,
            picture.height() as u32,
            ExtendedColorType::Rgb8,
        )
        .map_err(|source| FormatError::EntryPicture {
            name: "colour picture".to_owned(),
            source,
        })?;
    Ok(coded)
}
