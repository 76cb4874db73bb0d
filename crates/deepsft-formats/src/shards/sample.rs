//! A sample, and its entries in a shard.

use super::{DEPTH_UNITS_PER_MM, PARTS, UV_ONE};
use crate::camera::CameraFile;
use crate::error::FormatError;
use crate::image_codec;
use deepsft_geometry::glam::DVec3;
use deepsft_geometry::{Camera, ImageSize, Maps, OUTSIDE, Picture};
use image::{DynamicImage, ExtendedColorType, ImageFormat};
use serde::{Deserialize, Serialize};

/// One synthetic picture with its ground truth.
#[derive(Clone, Debug, PartialEq)]
pub struct Sample {
    /// The picture, as large as the camera's image.
    pub image: Picture,
    /// Exact depth (mm) and registration at the pixel centres of the front of the sheet where it is visible. The blank
    /// back, occluders and black bars are outside the object.
    pub truth: Maps,
    /// Vertices of the template's mesh, mm, camera frame; none when the template is not in the scene.
    pub vertices_camera: Vec<DVec3>,
    /// The camera that took the picture.
    pub camera: Camera,
    /// Whether the template's front is seen in at least one pixel.
    pub has_template: bool,
    /// Unit vector towards the distant light, camera frame.
    pub towards_light: DVec3,
}

impl Sample {
    /// A sample that has the template when `truth` is not empty.
    pub fn new(image: Picture, truth: Maps, vertices_camera: Vec<DVec3>, camera: Camera, towards_light: DVec3) -> Self {
        Self {
            image,
            has_template: truth.area() > 0,
            truth,
            vertices_camera,
            camera,
            towards_light,
        }
    }
}

/// A sample and where it came from.
#[derive(Clone, Debug, PartialEq)]
pub struct SampleRecord {
    /// Seed of the data set.
    pub seed: u64,
    /// Index of the sample within the data set.
    pub index: u64,
    /// The sample. Read from a shard, its truth is rounded (see [`write_shard`]).
    pub sample: Sample,
}

/// The JSON entry of a sample.
#[derive(Serialize, Deserialize)]
struct SampleJson {
    seed: u64,
    index: u64,
    has_template: bool,
    camera: CameraFile,
    towards_light: [f64; 3],
    vertices_camera: Vec<[f64; 3]>,
}

/// The entries of a sample, ready for a shard.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct EncodedSample(pub(super) [Vec<u8>; 4]);

impl SampleRecord {
    /// Whether it is the sample `index` of `seed`, as its data set's description says.
    ///
    /// # Errors
    /// [`FormatError::OtherSample`] when it is not.
    pub fn check_described(&self, seed: u64, index: u64) -> Result<(), FormatError> {
        if (self.seed, self.index) == (seed, index) {
            return Ok(());
        }
        Err(FormatError::OtherSample {
            seed: self.seed,
            index: self.index,
            expected_seed: seed,
            expected_index: index,
        })
    }

    /// Codes the sample for a shard.
    ///
    /// # Errors
    /// [`FormatError::DepthRange`] for a depth above 6553.5 mm; [`FormatError::EntryPicture`] and [`FormatError::Json`] for
    /// what cannot be coded.
    pub fn encode(&self) -> Result<EncodedSample, FormatError> {
        encode(self).map(EncodedSample)
    }
}

/// The contents of the entries of [`PARTS`].
fn encode(record: &SampleRecord) -> Result<[Vec<u8>; 4], FormatError> {
    let SampleRecord { sample, index, seed } = record;
    let (mut depth, mut uv) = (Vec::new(), Vec::new());
    for (&depth_mm, &coordinates) in sample.truth.depth().iter().zip(sample.truth.registration()) {
        let inside = depth_mm > OUTSIDE;
        let units = (depth_mm * DEPTH_UNITS_PER_MM).round();
        if inside && !(1.0..=65535.0).contains(&units) {
            return Err(FormatError::DepthRange {
                depth_mm,
                index: *index,
            });
        }
        let [u, v] = coordinates.map(|c| (c.clamp(0.0, 1.0) * UV_ONE).round() as u16);
        depth.extend((if inside { units as u16 } else { 0 }).to_ne_bytes());
        for value in if inside { [u, v, u16::MAX] } else { [0; 3] } {
            uv.extend(value.to_ne_bytes());
        }
    }
    let name = |part: usize| format!("{} of sample {index}", PARTS[part]);
    let png = |part: usize, bytes: &[u8], size: ImageSize, color: ExtendedColorType| {
        image_codec::encode_png(bytes, size, color).map_err(|source| FormatError::EntryPicture {
            name: name(part),
            source,
        })
    };
    let (image, size) = (&sample.image, sample.truth.size());
    let json = SampleJson {
        seed: *seed,
        index: *index,
        has_template: sample.has_template,
        camera: CameraFile::new(&sample.camera),
        towards_light: sample.towards_light.to_array(),
        vertices_camera: sample.vertices_camera.iter().map(DVec3::to_array).collect(),
    };
    Ok([
        png(0, image.rgb(), image.size(), ExtendedColorType::Rgb8)?,
        png(1, &depth, size, ExtendedColorType::L16)?,
        png(2, &uv, size, ExtendedColorType::Rgb16)?,
        serde_json::to_vec(&json).map_err(|source| FormatError::Json { name: name(3), source })?,
    ])
}

/// The sample of the entries of [`PARTS`].
pub(super) fn decode(key: &str, parts: &[Vec<u8>; 4]) -> Result<SampleRecord, FormatError> {
    let name = |part: usize| format!("{key}.{}", PARTS[part]);
    let json: SampleJson =
        serde_json::from_slice(&parts[3]).map_err(|source| FormatError::Json { name: name(3), source })?;
    let camera = json.camera.camera()?;
    let picture = |part: usize| {
        let image =
            image_codec::decode(&parts[part], Some(ImageFormat::Png)).map_err(|source| FormatError::EntryPicture {
                name: name(part),
                source,
            })?;
        let (actual, expected) = (image_codec::size_of(&image), camera.size());
        if actual != expected {
            let reason = format!("is {actual} pixels, expected the camera's {expected}");
            return Err(FormatError::entry(name(part), reason));
        }
        Ok(image)
    };
    let wrong = |part: usize, image: &DynamicImage, expected: &str| {
        FormatError::entry(name(part), format!("is {:?}, expected {expected}", image.color()))
    };
    let (rgb, depth, uv) = match (picture(0)?, picture(1)?, picture(2)?) {
        (DynamicImage::ImageRgb8(rgb), DynamicImage::ImageLuma16(depth), DynamicImage::ImageRgb16(uv)) => {
            (rgb, depth, uv)
        }
        (DynamicImage::ImageRgb8(_), DynamicImage::ImageLuma16(_), uv) => return Err(wrong(2, &uv, "16-bit RGB")),
        (DynamicImage::ImageRgb8(_), depth, _) => return Err(wrong(1, &depth, "16-bit grey")),
        (rgb, ..) => return Err(wrong(0, &rgb, "8-bit RGB")),
    };
    let (width, height) = (camera.width(), camera.height());
    let mut truth = Maps::empty(width, height);
    for (pixel, (depth, uv)) in depth.pixels().zip(uv.pixels()).enumerate() {
        if (depth.0[0] > 0) != (uv.0[2] > 0) {
            let actual = format!("inside and outside the object at pixel {pixel}");
            let reason = format!("is {actual}, expected the same mask as the depth");
            return Err(FormatError::entry(name(2), reason));
        }
        if depth.0[0] > 0 {
            let uv = [uv.0[0], uv.0[1]].map(|c| f32::from(c) / UV_ONE);
            truth.set(pixel, f32::from(depth.0[0]) / DEPTH_UNITS_PER_MM, uv);
        }
    }
    if json.has_template != (truth.area() > 0) {
        let actual = format!("has_template {} with {} pixels of it", json.has_template, truth.area());
        return Err(FormatError::entry(
            name(3),
            format!("is {actual}, expected the maps' own"),
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
    Ok(SampleRecord {
        seed: json.seed,
        index: json.index,
        sample,
    })
}
