//! The image files of samples and recordings: colour, 16-bit depth, masks, each as large as its camera's image.

use deepsft_formats::{FormatError, decode_image, encode_pixels};
use deepsft_geometry::{Camera, GeometryError, Picture};
use image::{DynamicImage, ExtendedColorType};

/// Decodes a PNG or JPEG file of the camera's size, as it is stored: no orientation, no transparency.
pub(crate) fn decode_picture_of_camera(bytes: &[u8], camera: &Camera) -> Result<Picture, FormatError> {
    let image = decode_of_camera(bytes, camera)?.into_rgb8();
    Ok(Picture::new(
        camera.size().width,
        camera.size().height,
        image.into_raw(),
    )?)
}

/// Decodes a 16-bit grey PNG file of the camera's size, row-major.
pub(crate) fn decode_depth(bytes: &[u8], camera: &Camera) -> Result<Vec<u16>, FormatError> {
    match decode_of_camera(bytes, camera)? {
        DynamicImage::ImageLuma16(depth) => Ok(depth.into_raw()),
        other => Err(refused(format!(
            "a depth picture is 16-bit grey, this one is {:?}: save it as 16-bit PNG",
            other.color()
        ))),
    }
}

/// Decodes an image file of the camera's size, as it is stored.
pub(crate) fn decode_of_camera(bytes: &[u8], camera: &Camera) -> Result<DynamicImage, FormatError> {
    decode_image(bytes, camera.size()).map_err(|error| match error {
        FormatError::Geometry(GeometryError::MapSize { actual, expected }) => refused(format!(
            "it has {actual} pixels, its camera {expected}: correct the camera, or leave it out"
        )),
        other => other,
    })
}

/// A depth picture as a 16-bit grey PNG file; `raw` is row-major, as large as the camera's image.
///
/// # Errors
/// [`FormatError::PictureFile`] when `raw` is of another size.
pub fn encode_depth_png(raw: &[u16], camera: &Camera) -> Result<Vec<u8>, FormatError> {
    let bytes: Vec<u8> = raw.iter().flat_map(|units| units.to_ne_bytes()).collect();
    encode_pixels(&bytes, camera.size(), ExtendedColorType::L16)
}

/// A mask as an 8-bit grey PNG file, 255 on the object; `mask` is row-major, as large as the camera's image.
///
/// # Errors
/// [`FormatError::PictureFile`] when `mask` is of another size.
pub fn encode_mask_png(mask: &[bool], camera: &Camera) -> Result<Vec<u8>, FormatError> {
    let bytes: Vec<u8> = mask.iter().map(|&inside| if inside { 255 } else { 0 }).collect();
    encode_pixels(&bytes, camera.size(), ExtendedColorType::L8)
}

fn refused(reason: impl ToString) -> FormatError {
    FormatError::PictureFile(reason.to_string())
}
