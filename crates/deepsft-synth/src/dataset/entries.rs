//! The entries of a sample in a shard.

use super::Reason;
use crate::camera_images::decode_of_camera;
use crate::error::SynthError;
use crate::sample::Sample;
use deepsft_formats::{CameraFile, FormatError, encode_pixels};
use deepsft_geometry::glam::DVec3;
use deepsft_geometry::{ImageSize, Maps, OUTSIDE, Picture};
use image::{DynamicImage, ExtendedColorType, ImageFormat, guess_format};
use serde::{Deserialize, Serialize};

/// Units of `depth.png` in a millimetre.
pub(super) const DEPTH_UNITS_PER_MM: f32 = 10.0;

pub(super) const UV_ONE: f32 = 65535.0;

/// Endings of a sample's entries.
pub(super) const ENTRIES: [&str; 4] = ["rgb.png", "depth.png", "uv.png", "json"];

#[derive(Serialize, Deserialize)]
struct SampleJson {
    seed: u64,
    index: u64,
    has_template: bool,
    camera: CameraFile,
    towards_light: [f64; 3],
    vertices_camera: Vec<[f64; 3]>,
}

/// The contents of the [`ENTRIES`] of sample `index` of `seed`.
///
/// # Errors
/// [`SynthError::DepthRange`] for a depth above 6553.5 mm, [`SynthError::Refused`] for what cannot be coded.
pub(super) fn encode(seed: u64, index: u64, sample: &Sample) -> Result<[Vec<u8>; 4], SynthError> {
    let (mut depth, mut uv) = (Vec::new(), Vec::new());
    for (&depth_mm, &coordinates) in sample.truth.depth().iter().zip(sample.truth.registration()) {
        let inside = depth_mm > OUTSIDE;
        let units = (depth_mm * DEPTH_UNITS_PER_MM).round();
        if inside && !(1.0..=65535.0).contains(&units) {
            return Err(SynthError::DepthRange { depth_mm, index });
        }
        let [u, v] = coordinates.map(|c| (c.clamp(0.0, 1.0) * UV_ONE).round() as u16);
        depth.extend((if inside { units as u16 } else { 0 }).to_ne_bytes());
        for value in if inside { [u, v, u16::MAX] } else { [0; 3] } {
            uv.extend(value.to_ne_bytes());
        }
    }
    let (image, size) = (&sample.image, sample.truth.size());
    let json = SampleJson {
        seed,
        index,
        has_template: sample.has_template,
        camera: CameraFile::new(&sample.camera),
        towards_light: sample.towards_light.to_array(),
        vertices_camera: sample.vertices_camera.iter().map(DVec3::to_array).collect(),
    };
    let png = |entry: usize, pixels: &[u8], size: ImageSize, color: ExtendedColorType| {
        encode_pixels(pixels, size, color).map_err(|error| {
            let reason = match error {
                FormatError::PictureFile(reason) => reason,
                other => other.to_string(),
            };
            let entry = ENTRIES[entry];
            SynthError::Refused(format!("{entry} of sample {index} cannot be written: {reason}"))
        })
    };
    Ok([
        png(0, image.rgb(), image.size(), ExtendedColorType::Rgb8)?,
        png(1, &depth, size, ExtendedColorType::L16)?,
        png(2, &uv, size, ExtendedColorType::Rgb16)?,
        // Numbers and fixed keys: there is nothing in it that JSON could not say.
        serde_json::to_vec(&json).unwrap_or_default(),
    ])
}

/// The seed, the index and the sample of the [`ENTRIES`].
pub(super) fn decode(entries: &[Vec<u8>; 4]) -> Result<(u64, u64, Sample), Reason> {
    let of =
        |entry: usize, reason: &dyn std::fmt::Display| -> Reason { format!("its {} {reason}", ENTRIES[entry]).into() };
    let json: SampleJson =
        serde_json::from_slice(&entries[3]).map_err(|error| of(3, &format!("is malformed: {error}")))?;
    let camera = json.camera.camera()?;
    let picture = |entry: usize| match guess_format(&entries[entry]) {
        Ok(ImageFormat::Png) => {
            decode_of_camera(&entries[entry], &camera).map_err(|error| of(entry, &format!("is refused: {error}")))
        }
        _ => Err(of(entry, &"is no PNG file")),
    };
    let wrong = |entry: usize, image: &DynamicImage, expected: &str| {
        of(entry, &format!("is {:?}, expected {expected}", image.color()))
    };
    let rgb = match picture(0)? {
        DynamicImage::ImageRgb8(rgb) => rgb,
        other => return Err(wrong(0, &other, "8-bit RGB")),
    };
    let depth = match picture(1)? {
        DynamicImage::ImageLuma16(depth) => depth,
        other => return Err(wrong(1, &other, "16-bit grey")),
    };
    let uv = match picture(2)? {
        DynamicImage::ImageRgb16(uv) => uv,
        other => return Err(wrong(2, &other, "16-bit RGB")),
    };
    let (width, height) = (camera.size().width, camera.size().height);
    let mut truth = Maps::empty((width, height));
    for (pixel, (depth, uv)) in depth.pixels().zip(uv.pixels()).enumerate() {
        if (depth.0[0] > 0) != (uv.0[2] > 0) {
            return Err(of(2, &format!("has another mask than the depth at pixel {pixel}")));
        }
        if depth.0[0] > 0 {
            let uv = [uv.0[0], uv.0[1]].map(|c| f32::from(c) / UV_ONE);
            truth.set(pixel, f32::from(depth.0[0]) / DEPTH_UNITS_PER_MM, uv);
        }
    }
    if json.has_template != (truth.area() > 0) {
        let area = truth.area();
        return Err(of(
            3,
            &format!("has has_template {} with {area} pixels of it", json.has_template),
        ));
    }
    let sample = Sample {
        image: Picture::new(width, height, rgb.into_raw())?,
        truth,
        vertices_camera: json.vertices_camera.into_iter().map(DVec3::from_array).collect(),
        camera,
        has_template: json.has_template,
        towards_light: DVec3::from_array(json.towards_light),
    };
    Ok((json.seed, json.index, sample))
}
