//! What a photograph's file says of its camera.

use ::exif::{Exif, In, Reader, Tag, Value};
use deepsft_geometry::Camera;
use deepsft_geometry::glam::DVec2;
use image::{ImageDecoder, ImageReader};
use std::io::Cursor;

/// Diagonal of a 35 mm frame (36 x 24 mm): equivalent focal lengths are those with the same angle across it.
const FRAME_DIAGONAL_MM: f64 = 43.266_615;

/// Focal lengths that a camera can have, as fractions of the long side of its image.
const POSSIBLE: std::ops::RangeInclusive<f64> = 0.2..=50.0;

/// How far the sides that EXIF tells may be from those of the image, as a fraction, after a resize: more is a crop.
const SAME_SHAPE: f64 = 0.01;

/// The camera of a PNG or JPEG file as its EXIF data tell it: the focal length from `FocalLengthIn35mmFilm`, or else from `FocalLength` and
/// the resolution of the sensor; square pixels, principal point in the middle, no distortion. For the picture as
/// [`crate::decode_picture`] gives it, turned upright.
///
/// `None` where the file says nothing of it, nothing possible, or another shape than the image has: it was cropped.
pub fn camera_from_exif(bytes: &[u8]) -> Option<Camera> {
    let mut decoder = ImageReader::new(Cursor::new(bytes))
        .with_guessed_format()
        .ok()?
        .into_decoder()
        .ok()?;
    let (width, height) = decoder.dimensions();
    let raw = decoder.exif_metadata().ok()??;
    let exif = Reader::new().read_raw(raw).ok()?;
    let focal = focal_px(&exif, [width, height].map(f64::from))?;
    // EXIF counts orientations 5 to 8 as those that exchange the sides.
    let lies = number(&exif, Tag::Orientation).is_some_and(|orientation| (5.0..=8.0).contains(&orientation));
    let (width, height) = if lies { (height, width) } else { (width, height) };
    let centre = DVec2::new(width.into(), height.into()) / 2.0;
    Camera::pinhole((width as usize, height as usize), DVec2::splat(focal), centre).ok()
}

fn focal_px(exif: &Exif, [width, height]: [f64; 2]) -> Option<f64> {
    let taken = [Tag::PixelXDimension, Tag::PixelYDimension].map(|tag| number(exif, tag).filter(|side| *side > 0.0));
    if let [Some(x), Some(y)] = taken
        && (x * height / (y * width) - 1.0).abs() > SAME_SHAPE
    {
        return None;
    }
    let equivalent = number(exif, Tag::FocalLengthIn35mmFilm).filter(|focal| *focal > 0.0);
    let by_equivalent = equivalent.map(|focal_mm| focal_mm / FRAME_DIAGONAL_MM * width.hypot(height));
    let by_sensor = || {
        // EXIF: 2 are inches, which go without saying; others have more.
        let unit_mm = match number(exif, Tag::FocalPlaneResolutionUnit).unwrap_or(2.0) as u32 {
            3 => 10.0,
            4 => 1.0,
            5 => 1e-3,
            _ => 25.4,
        };
        let pixels_per_mm = number(exif, Tag::FocalPlaneXResolution)? / unit_mm;
        Some(number(exif, Tag::FocalLength)? * pixels_per_mm * width / taken[0].unwrap_or(width))
    };
    by_equivalent
        .or_else(by_sensor)
        .filter(|focal| POSSIBLE.contains(&(focal / width.max(height))))
}

fn number(exif: &Exif, tag: Tag) -> Option<f64> {
    match &exif.get_field(tag, In::PRIMARY)?.value {
        Value::Rational(values) => values.first().map(|value| value.to_f64()),
        Value::Double(values) => values.first().copied(),
        value => value.get_uint(0).map(f64::from),
    }
}
