//! The pictures of a recording as files.

use crate::SynthError;
use crate::dataset::LONGEST_SIDE;
use deepsft_geometry::{Camera, Picture};
use image::codecs::jpeg::JpegEncoder;
use image::codecs::png::PngEncoder;
use image::{DynamicImage, ExtendedColorType, ImageEncoder, ImageReader, Limits};
use std::fs;
use std::io::Cursor;
use std::path::Path;

/// Reads an 8-bit PNG or JPEG file of the camera's size.
pub(super) fn read_picture(path: &Path, camera: &Camera) -> Result<Picture, SynthError> {
    let image = read(path, camera)?.into_rgb8();
    Ok(Picture::new(
        image.width() as usize,
        image.height() as usize,
        image.into_raw(),
    )?)
}

/// Reads a 16-bit grey PNG file of the camera's size.
pub(super) fn read_depth(path: &Path, camera: &Camera) -> Result<Vec<u16>, SynthError> {
    match read(path, camera)? {
        DynamicImage::ImageLuma16(depth) => Ok(depth.into_raw()),
        other => {
            let reason = format!("a depth picture is 16-bit grey, this one is {:?}", other.color());
            Err(SynthError::recording(reason, path))
        }
    }
}

fn read(path: &Path, camera: &Camera) -> Result<DynamicImage, SynthError> {
    let bytes = fs::read(path).map_err(|error| SynthError::recording(error.to_string(), path))?;
    let mut reader = ImageReader::new(Cursor::new(bytes.as_slice()))
        .with_guessed_format()
        .map_err(|error| SynthError::recording(error.to_string(), path))?;
    let mut limits = Limits::default();
    limits.max_image_width = Some(LONGEST_SIDE);
    limits.max_image_height = Some(LONGEST_SIDE);
    reader.limits(limits);
    let image = reader
        .decode()
        .map_err(|error| SynthError::recording(error.to_string(), path))?;
    if (image.width(), image.height()) != (camera.width(), camera.height()) {
        let reason = format!(
            "the picture has {} x {} pixels, its camera {} x {}",
            image.width(),
            image.height(),
            camera.width(),
            camera.height()
        );
        return Err(SynthError::recording(reason, path));
    }
    Ok(image)
}

/// A depth picture as a 16-bit grey PNG file; `raw` is row-major, as large as the camera's image.
///
/// # Errors
/// [`SynthError::EntryPicture`] from the codec, when `raw` is of another size.
pub fn encode_depth_png(raw: &[u16], camera: &Camera) -> Result<Vec<u8>, SynthError> {
    let bytes: Vec<u8> = raw.iter().flat_map(|units| units.to_ne_bytes()).collect();
    encode_png(&bytes, camera, ExtendedColorType::L16, "depth picture")
}

/// A mask as an 8-bit grey PNG file, 255 on the object; `mask` is row-major, as large as the camera's image.
///
/// # Errors
/// [`SynthError::EntryPicture`] from the codec, when `mask` is of another size.
pub fn encode_mask_png(mask: &[bool], camera: &Camera) -> Result<Vec<u8>, SynthError> {
    let bytes: Vec<u8> = mask.iter().map(|&inside| if inside { 255 } else { 0 }).collect();
    encode_png(&bytes, camera, ExtendedColorType::L8, "mask")
}

fn encode_png(bytes: &[u8], camera: &Camera, color: ExtendedColorType, name: &str) -> Result<Vec<u8>, SynthError> {
    let mut coded = Vec::new();
    let expected = camera.width() as usize * camera.height() as usize * usize::from(color.bits_per_pixel() / 8);
    if bytes.len() != expected {
        return Err(SynthError::EntryContent {
            name: name.to_owned(),
            actual: format!("{} bytes", bytes.len()),
            expected: format!("the camera's {expected}"),
        });
    }
    PngEncoder::new(&mut coded)
        .write_image(bytes, camera.width(), camera.height(), color)
        .map_err(|source| SynthError::EntryPicture {
            name: name.to_owned(),
            source,
        })?;
    Ok(coded)
}

/// A picture as a JPEG file of `quality` 1 to 100.
///
/// # Errors
/// [`SynthError::EntryPicture`] from the codec.
pub fn encode_jpeg(picture: &Picture, quality: u8) -> Result<Vec<u8>, SynthError> {
    let mut coded = Vec::new();
    JpegEncoder::new_with_quality(&mut coded, quality)
        .write_image(
            picture.rgb(),
            picture.width() as u32,
            picture.height() as u32,
            ExtendedColorType::Rgb8,
        )
        .map_err(|source| SynthError::EntryPicture {
            name: "colour picture".to_owned(),
            source,
        })?;
    Ok(coded)
}
