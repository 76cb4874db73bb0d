//! Data sets on disk: WebDataset-style tar shards.
//!
//! A shard holds four entries for each sample, `NNNNNN` being its number within the shard:
//!
//! | entry | content |
//! |---|---|
//! | `NNNNNN.rgb.png` | the picture, 8-bit RGB |
//! | `NNNNNN.depth.png` | depth, 16-bit grey, in tenths of a millimetre; 0 is outside the object |
//! | `NNNNNN.uv.png` | registration, 16-bit RGB: u and v times 65535 in red and green; blue is 65535 on the object and 0 outside, where red and green are 0 too |
//! | `NNNNNN.json` | seed, index, has_template, camera, towards_light, vertices_camera (mm) |
//!
//! So depth comes back within 0.05 mm and registration within 1 / 131070.

use crate::{Sample, SynthError};
use deepsft_geometry::glam::DVec3;
use deepsft_geometry::{Camera, OUTSIDE};
use image::codecs::png::PngEncoder;
use image::{ExtendedColorType, ImageEncoder};
use serde::{Deserialize, Serialize};
use std::io::Write;

/// Units of `depth.png` in a millimetre.
pub(crate) const DEPTH_UNITS_PER_MM: f32 = 10.0;

/// Value of 1 in `uv.png`.
pub(crate) const UV_ONE: f32 = 65535.0;

/// Endings of a sample's entries.
pub(crate) const PARTS: [&str; 4] = ["rgb.png", "depth.png", "uv.png", "json"];

/// Longest side of a picture that is decoded, pixels.
pub(crate) const LONGEST_SIDE: u32 = 8192;

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
pub(crate) struct SampleJson {
    pub(crate) seed: u64,
    pub(crate) index: u64,
    pub(crate) has_template: bool,
    pub(crate) camera: CameraJson,
    pub(crate) towards_light: [f64; 3],
    pub(crate) vertices_camera: Vec<[f64; 3]>,
}

/// A camera in JSON: the fields of `camera.json`. The crate `deepsft` has them too: neither crate may use the other,
/// and the geometry that both use knows no files.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct CameraJson {
    width: u32,
    height: u32,
    fx: f64,
    fy: f64,
    cx: f64,
    cy: f64,
    #[serde(default)]
    distortion: [f64; 5],
}

impl CameraJson {
    pub(crate) fn new(camera: &Camera) -> Self {
        let (focal, principal) = (camera.focal(), camera.principal_point());
        Self {
            width: camera.width(),
            height: camera.height(),
            fx: focal.x,
            fy: focal.y,
            cx: principal.x,
            cy: principal.y,
            distortion: camera.distortion(),
        }
    }

    pub(crate) fn camera(&self) -> Result<Camera, SynthError> {
        let camera = Camera::pinhole(self.width, self.height, self.fx, self.fy, self.cx, self.cy)?;
        Ok(camera.with_distortion(self.distortion)?)
    }
}

/// Writes samples as a shard, numbered from 0 in their order; returns how many there were. Depth is rounded to 0.1 mm,
/// registration to 1 / 65535.
///
/// # Errors
/// [`SynthError::Io`] from `out`, [`SynthError::DepthRange`] for a depth above 6553.5 mm.
pub fn write_shard(out: impl Write, records: impl IntoIterator<Item = SampleRecord>) -> Result<u64, SynthError> {
    let mut shard = ShardWriter::new(out);
    for record in records {
        shard.append(&record.encode()?)?;
    }
    let (number, _) = shard.finish()?;
    Ok(number)
}

/// The entries of a sample, ready for a shard.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct EncodedSample([Vec<u8>; 4]);

/// Writes a shard sample by sample. Coding takes long and writing does not: with [`SampleRecord::encode`] many threads
/// can feed one writer.
pub struct ShardWriter<W: Write> {
    archive: tar::Builder<W>,
    samples: u64,
}

impl<W: Write> std::fmt::Debug for ShardWriter<W> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("ShardWriter")
            .field("samples", &self.samples)
            .finish_non_exhaustive()
    }
}

impl<W: Write> ShardWriter<W> {
    /// An empty shard.
    pub fn new(out: W) -> Self {
        Self {
            archive: tar::Builder::new(out),
            samples: 0,
        }
    }

    /// Adds the next sample.
    ///
    /// # Errors
    /// [`SynthError::Io`] from the output.
    pub fn append(&mut self, sample: &EncodedSample) -> Result<(), SynthError> {
        for (part, content) in PARTS.into_iter().zip(&sample.0) {
            // Nothing of the machine or the moment goes into the header: equal samples are equal bytes.
            let mut header = tar::Header::new_ustar();
            header.set_size(content.len() as u64);
            header.set_mode(0o644);
            let name = format!("{:06}.{part}", self.samples);
            self.archive.append_data(&mut header, name, content.as_slice())?;
        }
        self.samples += 1;
        Ok(())
    }

    /// Ends the shard; gives the number of its samples and the output.
    ///
    /// # Errors
    /// [`SynthError::Io`] from the output.
    pub fn finish(self) -> Result<(u64, W), SynthError> {
        let mut out = self.archive.into_inner()?;
        out.flush()?;
        Ok((self.samples, out))
    }
}

impl SampleRecord {
    /// Codes the sample for a shard.
    ///
    /// # Errors
    /// [`SynthError::DepthRange`] for a depth above 6553.5 mm; [`SynthError::EntryPicture`] and [`SynthError::Json`] for
    /// what cannot be coded.
    pub fn encode(&self) -> Result<EncodedSample, SynthError> {
        encode(self).map(EncodedSample)
    }
}

/// The contents of the entries of [`PARTS`].
fn encode(record: &SampleRecord) -> Result<[Vec<u8>; 4], SynthError> {
    let SampleRecord { sample, index, seed } = record;
    let (width, height) = (sample.truth.width() as u32, sample.truth.height() as u32);
    let (mut depth, mut uv) = (Vec::new(), Vec::new());
    for (&depth_mm, &coordinates) in sample.truth.depth().iter().zip(sample.truth.registration()) {
        let inside = depth_mm > OUTSIDE;
        let units = (depth_mm * DEPTH_UNITS_PER_MM).round();
        if inside && !(1.0..=65535.0).contains(&units) {
            return Err(SynthError::DepthRange {
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
    let png = |part: usize, bytes: &[u8], width: u32, height: u32, color: ExtendedColorType| {
        let mut coded = Vec::new();
        match PngEncoder::new(&mut coded).write_image(bytes, width, height, color) {
            Ok(()) => Ok(coded),
            Err(source) => Err(SynthError::EntryPicture {
                name: format!("{} of sample {index}", PARTS[part]),
                source,
            }),
        }
    };
    let image = &sample.image;
    let json = SampleJson {
        seed: *seed,
        index: *index,
        has_template: sample.has_template,
        camera: CameraJson::new(&sample.camera),
        towards_light: sample.towards_light.to_array(),
        vertices_camera: sample.vertices_camera.iter().map(DVec3::to_array).collect(),
    };
    Ok([
        png(
            0,
            image.rgb(),
            image.width() as u32,
            image.height() as u32,
            ExtendedColorType::Rgb8,
        )?,
        png(1, &depth, width, height, ExtendedColorType::L16)?,
        png(2, &uv, width, height, ExtendedColorType::Rgb16)?,
        serde_json::to_vec(&json).map_err(|source| SynthError::Json {
            name: format!("{} of sample {index}", PARTS[3]),
            source,
        })?,
    ])
}
