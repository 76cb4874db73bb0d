//! Shards read sample by sample, in their order.

use crate::dataset::{DEPTH_UNITS_PER_MM, LONGEST_SIDE, PARTS, SampleJson, UV_ONE};
use crate::{Sample, SampleRecord, SynthError};
use deepsft_geometry::glam::DVec3;
use deepsft_geometry::{Maps, Picture};
use image::{DynamicImage, ImageFormat, ImageReader, Limits};
use std::io::{Cursor, Read};

/// Largest entry that is read, bytes: a 16-bit RGB map of 4096 x 2160 uncompressed.
const LARGEST_ENTRY: u64 = 64 << 20;

/// Reads a shard sample by sample.
///
/// ```
/// use deepsft_geometry::{Picture, Template};
/// use deepsft_synth::{SampleRecord, ShardReader, SynthConfig, Synthesizer, write_shard};
/// let template = Template::thin_shell(Picture::from_fn(8, 6, |x, y| [30 * x as u8, 40 * y as u8, 0]), 200.0, 150.0)?;
/// let synthesizer = Synthesizer::new(&template, SynthConfig::default())?;
/// let mut shard = Vec::new();
/// write_shard(&mut shard, (0..2).map(|index| SampleRecord { seed: 1, index, sample: synthesizer.sample(1, index) }))?;
/// let mut reader = ShardReader::new(shard.as_slice());
/// for record in reader.records()? {
///     let record = record?;
///     assert_eq!(record.sample.image, synthesizer.sample(1, record.index).image);
/// }
/// # Ok::<(), deepsft_synth::SynthError>(())
/// ```
pub struct ShardReader<R: Read> {
    archive: tar::Archive<R>,
}

impl<R: Read> std::fmt::Debug for ShardReader<R> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("ShardReader").finish_non_exhaustive()
    }
}

impl<R: Read> ShardReader<R> {
    /// A reader of the shard in `input`.
    pub fn new(input: R) -> Self {
        Self {
            archive: tar::Archive::new(input),
        }
    }

    /// The samples in their order; after an error there are no more. Each item fails with the entry's name when an entry
    /// is foreign, missing, there twice, truncated, too large or not what it should be.
    ///
    /// # Errors
    /// [`SynthError::Io`] when the input is no tar archive or this is the second call.
    pub fn records(&mut self) -> Result<impl Iterator<Item = Result<SampleRecord, SynthError>>, SynthError> {
        let mut entries = self.archive.entries()?;
        let mut pending = PendingSample::default();
        let mut ended = false;
        Ok(std::iter::from_fn(move || {
            while !ended {
                let step = match entries.next() {
                    Some(entry) => entry
                        .map_err(SynthError::from)
                        .and_then(|entry| pending.take(entry, content))
                        .and_then(|sample| sample.map(|(key, parts)| decode(&key, &parts)).transpose()),
                    None => {
                        ended = true;
                        pending.finish().map(|()| None)
                    }
                };
                ended |= step.is_err();
                if let Some(result) = step.transpose() {
                    return Some(result);
                }
            }
            None
        }))
    }
}

/// The parts of the sample whose entries are coming, and what is made of each.
pub(crate) struct PendingSample<T> {
    key: String,
    parts: [Option<T>; 4],
}

impl<T> Default for PendingSample<T> {
    fn default() -> Self {
        Self {
            key: String::new(),
            parts: [const { None }; 4],
        }
    }
}

impl<T> PendingSample<T> {
    /// Takes in what `read` makes of an entry, which is given its name; gives the key and the parts of a sample when it
    /// was the last of one.
    pub(crate) fn take<R: Read>(
        &mut self,
        entry: tar::Entry<'_, R>,
        read: impl FnOnce(tar::Entry<'_, R>, String) -> Result<T, SynthError>,
    ) -> Result<Option<(String, [T; 4])>, SynthError> {
        let name = String::from_utf8_lossy(&entry.path_bytes()).into_owned();
        let foreign = || SynthError::ForeignEntry { name: name.clone() };
        let (key, part) = name.split_once('.').ok_or_else(foreign)?;
        let part = PARTS.iter().position(|known| *known == part).ok_or_else(foreign)?;
        let numbered = !key.is_empty() && key.bytes().all(|byte| byte.is_ascii_digit());
        if !numbered || !entry.header().entry_type().is_file() {
            return Err(foreign());
        }
        if !self.key.is_empty() && self.key != key {
            return Err(self.missing());
        }
        key.clone_into(&mut self.key);
        if self.parts[part].is_some() {
            return Err(SynthError::RepeatedEntry { name });
        }
        self.parts[part] = Some(read(entry, name)?);
        match std::mem::take(&mut self.parts) {
            [Some(image), Some(depth), Some(registration), Some(json)] => {
                let key = std::mem::take(&mut self.key);
                Ok(Some((key, [image, depth, registration, json])))
            }
            parts => {
                self.parts = parts;
                Ok(None)
            }
        }
    }

    /// At the end of the shard: nothing may be pending.
    pub(crate) fn finish(&self) -> Result<(), SynthError> {
        if self.key.is_empty() {
            Ok(())
        } else {
            Err(self.missing())
        }
    }

    fn missing(&self) -> SynthError {
        let missing = PARTS.iter().zip(&self.parts).find(|(_, content)| content.is_none());
        SynthError::MissingPart {
            key: self.key.clone(),
            part: missing.map_or("", |(part, _)| *part),
        }
    }
}

/// The content of the entry `name`.
fn content<R: Read>(mut entry: tar::Entry<'_, R>, name: String) -> Result<Vec<u8>, SynthError> {
    let expected = entry.size();
    if expected > LARGEST_ENTRY {
        let (actual, expected) = (format!("{expected} bytes"), format!("at most {LARGEST_ENTRY} bytes"));
        return Err(SynthError::EntryContent { name, actual, expected });
    }
    let mut content = Vec::new();
    let read = entry.read_to_end(&mut content);
    let actual = content.len() as u64;
    match read {
        Ok(_) if actual == expected => Ok(content),
        Err(error) if error.kind() != std::io::ErrorKind::UnexpectedEof => Err(error.into()),
        _ => Err(SynthError::TruncatedEntry { name, actual, expected }),
    }
}

/// The sample of the entries of [`PARTS`].
fn decode(key: &str, parts: &[Vec<u8>; 4]) -> Result<SampleRecord, SynthError> {
    let name = |part: usize| format!("{key}.{}", PARTS[part]);
    let json: SampleJson =
        serde_json::from_slice(&parts[3]).map_err(|source| SynthError::Json { name: name(3), source })?;
    let camera = json.camera.camera()?;
    let picture = |part: usize| {
        let image = decode_png(&parts[part]).map_err(|source| SynthError::EntryPicture {
            name: name(part),
            source,
        })?;
        if (image.width(), image.height()) != (camera.width(), camera.height()) {
            let actual = format!("{} x {} pixels", image.width(), image.height());
            let expected = format!("the camera's {} x {}", camera.width(), camera.height());
            return Err(SynthError::EntryContent {
                name: name(part),
                actual,
                expected,
            });
        }
        Ok(image)
    };
    let wrong = |part: usize, image: &DynamicImage, expected: &str| SynthError::EntryContent {
        name: name(part),
        actual: format!("{:?}", image.color()),
        expected: expected.into(),
    };
    let (rgb, depth, uv) = match (picture(0)?, picture(1)?, picture(2)?) {
        (DynamicImage::ImageRgb8(rgb), DynamicImage::ImageLuma16(depth), DynamicImage::ImageRgb16(uv)) => {
            (rgb, depth, uv)
        }
        (DynamicImage::ImageRgb8(_), DynamicImage::ImageLuma16(_), uv) => return Err(wrong(2, &uv, "16-bit RGB")),
        (DynamicImage::ImageRgb8(_), depth, _) => return Err(wrong(1, &depth, "16-bit grey")),
        (rgb, ..) => return Err(wrong(0, &rgb, "8-bit RGB")),
    };
    let (width, height) = (camera.width() as usize, camera.height() as usize);
    let mut truth = Maps::empty(width, height);
    for (pixel, (depth, uv)) in depth.pixels().zip(uv.pixels()).enumerate() {
        if (depth.0[0] > 0) != (uv.0[2] > 0) {
            let actual = format!("inside and outside the object at pixel {pixel}");
            let expected = "the same mask as the depth".into();
            return Err(SynthError::EntryContent {
                name: name(2),
                actual,
                expected,
            });
        }
        if depth.0[0] > 0 {
            let uv = [uv.0[0], uv.0[1]].map(|c| f32::from(c) / UV_ONE);
            truth.set(pixel, f32::from(depth.0[0]) / DEPTH_UNITS_PER_MM, uv);
        }
    }
    if json.has_template != (truth.area() > 0) {
        let actual = format!("has_template {} with {} pixels of it", json.has_template, truth.area());
        return Err(SynthError::EntryContent {
            name: name(3),
            actual,
            expected: "the maps' own".into(),
        });
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

fn decode_png(bytes: &[u8]) -> image::ImageResult<DynamicImage> {
    let mut reader = ImageReader::with_format(Cursor::new(bytes), ImageFormat::Png);
    let mut limits = Limits::default();
    limits.max_image_width = Some(LONGEST_SIDE);
    limits.max_image_height = Some(LONGEST_SIDE);
    reader.limits(limits);
    reader.decode()
}
