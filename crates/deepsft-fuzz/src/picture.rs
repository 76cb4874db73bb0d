//! Pictures of people, and what EXIF says of the camera.

use crate::files::is_one_of;
use crate::png;
use anyhow::Result;
use deepsft::{decode_picture, encode_png};
use deepsft_formats::{camera_from_exif, encode_jpeg};
use deepsft_geometry::{ImageSize, Picture};
use image::codecs::jpeg::JpegEncoder;
use image::{ExtendedColorType, ImageEncoder, ImageFormat, ImageReader};
use std::io::Cursor;

/// Pixels from which few JPEG files are decoded: their pixels are all there, however short the file is.
const MANY_PIXELS: u64 = 1 << 18;

/// One of so many pictures is written and read again, which takes longer than reading it.
const WRITTEN: u32 = 4;

/// One of so many of them is.
const RARELY: u32 = 256;

pub(crate) fn read(input: &[u8]) -> Result<()> {
    let file = png::repaired(input);
    // Of files that are no pictures too.
    camera_from_exif(&file, (4000, 3000));
    if is_slow(&file) {
        return Ok(());
    }
    let picture = decode_picture(&file)?;
    if let Some(camera) = camera_from_exif(&file, picture.size()) {
        assert_eq!(camera.size(), picture.size(), "EXIF tells of another picture");
    }
    check(&picture);
    Ok(())
}

/// Whether a file is a JPEG file of many pixels that is left out.
pub(crate) fn is_slow(file: &[u8]) -> bool {
    if !file.starts_with(&[0xff, 0xd8]) {
        return false;
    }
    let size = ImageReader::new(Cursor::new(file))
        .with_guessed_format()
        .map(ImageReader::into_dimensions);
    let Ok(Ok((width, height))) = size else { return false };
    u64::from(width) * u64::from(height) > MANY_PIXELS && !is_one_of(RARELY, file)
}

/// What is promised of a picture.
pub(crate) fn check(picture: &Picture) {
    let ImageSize { width, height } = picture.size();
    assert_eq!(picture.rgb().len(), 3 * width * height);
    let (right, bottom) = (width as f64, height as f64);
    for (x, y) in [(0.0, 0.0), (right, bottom), (right / 3.0, f64::INFINITY)] {
        assert!(picture.sample(x, y).iter().all(|value| (0.0..=255.0).contains(value)));
    }
    if is_one_of(WRITTEN, picture.rgb()) {
        let again = encode_png(picture).and_then(|png| decode_picture(&png));
        let is_same = again.is_ok_and(|again| again == *picture);
        assert!(is_same, "written and read again it is another picture");
    }
}

/// A picture of few pixels.
pub(crate) fn small(width: usize, height: usize) -> Picture {
    Picture::from_fn(width, height, |x, y| [(40 * x) as u8, (60 * y) as u8, 90])
}

/// EXIF data: a focal length of 26 mm and a picture that lies on its side.
const EXIF: &[u8] =
    b"MM\0*\0\0\0\x08\0\x02\x01\x12\0\x03\0\0\0\x01\0\x06\0\0\xa4\x05\0\x03\0\0\0\x01\0\x1a\0\0\0\0\0\0";

pub(crate) fn seeds() -> Result<Vec<Vec<u8>>> {
    let picture = small(5, 4);
    let mut jpeg = Vec::new();
    let mut encoder = JpegEncoder::new_with_quality(&mut jpeg, 60);
    encoder.set_exif_metadata(EXIF.to_vec())?;
    encoder.write_image(picture.rgb(), 5, 4, ExtendedColorType::Rgb8)?;
    let mut grey = Vec::new();
    JpegEncoder::new(&mut grey).write_image(&[9; 63], 9, 7, ExtendedColorType::L8)?;
    let colors = [255, 0, 0, 0, 255, 0];
    let palette = |bytes: usize, more: &[(&[u8; 4], &[u8])]| {
        let chunks = [&[(b"PLTE", &colors[..bytes])], more].concat();
        png::stored([8, 2], [1, 3, 0], &chunks, &[0, 0x5a, 0, 0xa5])
    };
    let filters = [0, 1, 2, 3, 1, 4, 5, 6, 2, 7, 8, 9, 3, 1, 2, 3, 4, 4, 5, 6];
    let deep = [0, 1, 2, 3, 4, 5, 6, 7, 8, 8, 7, 6, 5, 4, 3, 2, 1];
    let other = |format| -> Result<Vec<u8>> {
        let mut file = Cursor::new(Vec::new());
        image::write_buffer_with_format(&mut file, picture.rgb(), 5, 4, ExtendedColorType::Rgb8, format)?;
        Ok(file.into_inner())
    };
    Ok(vec![
        encode_png(&picture)?,
        encode_jpeg(&picture, 90)?,
        jpeg,
        grey,
        // RGB of 8 bits with each filter; RGBA of 16; grey with alpha, interlaced; a palette of 1 bit, with EXIF data.
        png::stored([1, 5], [8, 2, 0], &[], &filters),
        png::stored([2, 1], [16, 6, 0], &[], &deep),
        png::stored([2, 2], [8, 4, 1], &[], &[0, 1, 2, 0, 3, 4, 0, 5, 6, 7, 8]),
        palette(6, &[(b"tRNS", &[9]), (b"eXIf", EXIF)]),
        // Palettes that end within a colour, on which a decoder panicked once.
        palette(4, &[]),
        palette(5, &[]),
        other(ImageFormat::WebP)?,
        other(ImageFormat::Bmp)?,
        other(ImageFormat::Tiff)?,
        other(ImageFormat::Gif)?,
    ])
}
