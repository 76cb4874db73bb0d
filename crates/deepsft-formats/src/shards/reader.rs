//! Shards read sample by sample, in their order.

use super::sample::decode;
use super::{PARTS, SampleRecord};
use crate::error::FormatError;
use crate::foreign::guarded;
use std::io::Read;

/// Largest entry that is read, bytes: a 16-bit RGB map of 4096 x 2160 uncompressed.
const LARGEST_ENTRY: u64 = 64 << 20;

/// Reads a shard sample by sample.
///
/// ```
/// use deepsft_formats::{Sample, SampleRecord, ShardReader, write_shard};
/// use deepsft_geometry::{Maps, Picture, glam::DVec3, training_camera};
/// // A picture without the object.
/// let image = Picture::from_fn(480, 270, |x, y| [x as u8, y as u8, 9]);
/// let sample = Sample::new(image, Maps::empty(480, 270), Vec::new(), training_camera(), DVec3::NEG_Z);
/// let mut shard = Vec::new();
/// write_shard(&mut shard, (0..2).map(|index| SampleRecord { seed: 1, index, sample: sample.clone() }))?;
/// let mut reader = ShardReader::new(shard.as_slice());
/// for record in reader.records()? {
///     assert_eq!(record?.sample, sample);
/// }
/// # Ok::<(), deepsft_formats::FormatError>(())
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
    /// [`FormatError::Io`] when the input is no tar archive or this is the second call.
    pub fn records(&mut self) -> Result<impl Iterator<Item = Result<SampleRecord, FormatError>>, FormatError> {
        let mut entries = self.archive.entries()?;
        let mut pending = PendingSample::default();
        let mut ended = false;
        Ok(std::iter::from_fn(move || {
            while !ended {
                let step = guarded(|| match entries.next() {
                    Some(entry) => entry
                        .map_err(FormatError::from)
                        .and_then(|entry| pending.take(entry, content))
                        .and_then(|sample| sample.map(|(key, parts)| decode(&key, &parts)).transpose()),
                    None => {
                        ended = true;
                        pending.finish().map(|()| None)
                    }
                });
                let step = step.unwrap_or_else(|error| Err(error.into()));
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
pub(super) struct PendingSample<T> {
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
    pub(super) fn take<R: Read>(
        &mut self,
        entry: tar::Entry<'_, R>,
        read: impl FnOnce(tar::Entry<'_, R>, String) -> Result<T, FormatError>,
    ) -> Result<Option<(String, [T; 4])>, FormatError> {
        let name = String::from_utf8_lossy(&entry.path_bytes()).into_owned();
        let foreign = || FormatError::entry(&name, "is not NNNNNN.rgb.png, .depth.png, .uv.png or .json");
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
            return Err(FormatError::entry(name, "is there twice"));
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
    pub(super) fn finish(&self) -> Result<(), FormatError> {
        if self.key.is_empty() {
            Ok(())
        } else {
            Err(self.missing())
        }
    }

    fn missing(&self) -> FormatError {
        let missing = PARTS.iter().zip(&self.parts).find(|(_, content)| content.is_none());
        FormatError::MissingPart {
            key: self.key.clone(),
            part: missing.map_or("", |(part, _)| *part),
        }
    }
}

/// The content of the entry `name`.
fn content<R: Read>(mut entry: tar::Entry<'_, R>, name: String) -> Result<Vec<u8>, FormatError> {
    let expected = entry.size();
    if expected > LARGEST_ENTRY {
        let reason = format!("is {expected} bytes, expected at most {LARGEST_ENTRY} bytes");
        return Err(FormatError::entry(name, reason));
    }
    let mut content = Vec::new();
    let read = entry.read_to_end(&mut content);
    let actual = content.len() as u64;
    match read {
        Ok(_) if actual == expected => Ok(content),
        Err(error) if error.kind() != std::io::ErrorKind::UnexpectedEof => Err(error.into()),
        _ => Err(FormatError::truncated(name, actual, expected)),
    }
}
