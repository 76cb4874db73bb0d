//! What a photograph's file says of its camera.

use crate::foreign::guarded;
use ::exif::{Exif, In, Reader, Tag, Value};
use deepsft_geometry::glam::DVec2;
use deepsft_geometry::{Camera, ImageSize};
use std::io::Cursor;

/// Diagonal of a 35 mm frame (36 x 24 mm): equivalent focal lengths are those with the same angle across it.
const FRAME_DIAGONAL_MM: f64 = 43.266_615;

/// Focal lengths that a camera can have, as fractions of the long side of its image.
const POSSIBLE: std::ops::RangeInclusive<f64> = 0.2..=50.0;

/// How far the sides that EXIF tells may be from those of the image, as a fraction, after a resize: more is a crop.
const SAME_SHAPE: f64 = 0.01;

/// The camera of a JPEG, PNG, WebP, TIFF or HEIF file as its EXIF data tell it, for the picture of `size` (columns, rows) that it
/// holds, turned upright or not: square pixels, principal point in the middle, no distortion.
///
/// The focal length comes from `FocalLengthIn35mmFilm`, taken across the diagonal; digital zoom is part of it. Where that is missing
/// it comes from `FocalLength`, the sensor's resolution (`FocalPlaneXResolution`) and `DigitalZoomRatio`. A resized picture has the same
/// angles, so both follow its size.
///
/// `None` where the file says nothing of it, nothing possible, or another shape than the picture has: it was cropped. A crop of
/// the same shape looks like a resize.
pub fn camera_from_exif(bytes: &[u8], size: impl Into<ImageSize>) -> Option<Camera> {
    let size = size.into();
    let sides = size.as_dvec2();
    // Fields are decoded when they are asked for.
    let focal = || {
        let mut reader = Reader::new();
        let read = reader
            .continue_on_error(true)
            .read_from_container(&mut Cursor::new(bytes));
        let exif = read.or_else(|error| error.distill_partial_result(|_| ()));
        focal_px(&exif.ok()?, sides.into())
    };
    Camera::pinhole(size, DVec2::splat(guarded(focal).ok()??), sides / 2.0).ok()
}

/// Sides in any order: EXIF gives them as the sensor lies.
fn focal_px(exif: &Exif, sides: [f64; 2]) -> Option<f64> {
    let long = |[a, b]: [f64; 2]| a.max(b);
    let shape = |[a, b]: [f64; 2]| a.max(b) / a.min(b);
    let taken = match [Tag::PixelXDimension, Tag::PixelYDimension].map(|tag| positive(exif, tag)) {
        [Some(x), Some(y)] => [x, y],
        _ => sides,
    };
    if (shape(taken) / shape(sides) - 1.0).abs() > SAME_SHAPE {
        return None;
    }
    let equivalent = positive(exif, Tag::FocalLengthIn35mmFilm);
    let by_equivalent = equivalent.map(|focal_mm| focal_mm / FRAME_DIAGONAL_MM * sides[0].hypot(sides[1]));
    let by_sensor = || {
        // EXIF: 2 are inches, which go without saying; others have more.
        let unit_mm = match number(exif, Tag::FocalPlaneResolutionUnit).unwrap_or(2.0) as u32 {
            3 => 10.0,
            4 => 1.0,
            5 => 1e-3,
            _ => 25.4,
        };
        let pixels_per_mm = number(exif, Tag::FocalPlaneXResolution)? / unit_mm;
        let zoom = positive(exif, Tag::DigitalZoomRatio).unwrap_or(1.0);
        Some(number(exif, Tag::FocalLength)? * zoom * pixels_per_mm * long(sides) / long(taken))
    };
    by_equivalent
        .or_else(by_sensor)
        .filter(|focal| POSSIBLE.contains(&(focal / long(sides))))
}

/// 0 stands for unknown, of a digital zoom for none.
fn positive(exif: &Exif, tag: Tag) -> Option<f64> {
    number(exif, tag).filter(|number| *number > 0.0)
}

fn number(exif: &Exif, tag: Tag) -> Option<f64> {
    match &exif.get_field(tag, In::PRIMARY)?.value {
        Value::Rational(values) => values.first().map(|value| value.to_f64()),
        Value::Double(values) => values.first().copied(),
        value => value.get_uint(0).map(f64::from),
    }
}
