//! Shards read out of order: where each sample lies is found once, the samples are read when they are asked for.

use super::reader::PendingSample;
use super::{SampleRecord, ShardReader};
use crate::error::FormatError;
use crate::foreign::guarded;
use deepsft_geometry::Camera;
use std::fs::File;
use std::io::{Read, Seek, SeekFrom};
use std::ops::Range;
use std::path::{Path, PathBuf};

/// The samples of shards by their number, one shard after the other. Kept are positions alone, 16 bytes a sample: a set may
/// be larger than memory. Threads may read at once.
///
/// ```
/// use deepsft_formats::{IndexedShards, Sample, SampleRecord, write_shard};
/// use deepsft_geometry::{Maps, Picture, glam::DVec3, training_camera};
/// // A picture without the object.
/// let image = Picture::from_fn(480, 270, |x, y| [x as u8, y as u8, 9]);
/// let sample = Sample::new(image, Maps::empty(480, 270), Vec::new(), training_camera(), DVec3::NEG_Z);
/// let folder = tempfile::tempdir()?;
/// let path = folder.path().join("shard-000000.tar");
/// let records = (0..3).map(|index| SampleRecord { seed: 1, index, sample: sample.clone() });
/// write_shard(std::fs::File::create(&path)?, records)?;
/// let mut shards = IndexedShards::new(training_camera());
/// assert_eq!(shards.add(path)?, 3);
/// assert_eq!(shards.record(2)?.index, 2);
/// # Ok::<(), deepsft_formats::FormatError>(())
/// ```
#[derive(Clone, Debug)]
pub struct IndexedShards {
    camera: Camera,
    shards: Vec<IndexedShard>,
}

/// A shard and where its samples lie in it.
#[derive(Clone, Debug)]
struct IndexedShard {
    path: PathBuf,
    /// Number of its first sample.
    first: u64,
    /// Seed of its samples and index of the first, where they are described.
    described: Option<(u64, u64)>,
    /// The bytes of each sample's entries.
    samples: Vec<Range<u64>>,
}

impl IndexedShards {
    /// No shards yet; their samples are to be taken by `camera`.
    pub fn new(camera: Camera) -> Self {
        let shards = Vec::new();
        Self { camera, shards }
    }

    /// Adds the shard at `path` after those there are, and gives the number of its samples. Names and sizes of all its
    /// entries are checked; its first sample is read.
    ///
    /// # Errors
    /// [`FormatError::File`] when the file cannot be read, is cut, holds what is no sample, or its first sample cannot be
    /// decoded or was taken by another camera.
    pub fn add(&mut self, path: impl Into<PathBuf>) -> Result<u64, FormatError> {
        self.add_shard(path.into(), None)
    }

    /// As [`IndexedShards::add`], for a shard whose samples are described: they are those of `seed` from `index` on. A sample
    /// that is read and is another one is an error.
    ///
    /// # Errors
    /// Those of [`IndexedShards::add`], and [`FormatError::File`] when its first sample is not the one described.
    pub fn add_described(&mut self, path: impl Into<PathBuf>, seed: u64, index: u64) -> Result<u64, FormatError> {
        self.add_shard(path.into(), Some((seed, index)))
    }

    fn add_shard(&mut self, path: PathBuf, described: Option<(u64, u64)>) -> Result<u64, FormatError> {
        let samples = guarded(|| positions(&path)).unwrap_or_else(|error| Err(error.into()));
        let samples = samples.map_err(|error| FormatError::unreadable(&path, error))?;
        let (first, count) = (self.samples(), samples.len() as u64);
        if count > 0 {
            self.shards.push(IndexedShard {
                path,
                first,
                described,
                samples,
            });
            if let Err(error) = self.record(first) {
                self.shards.pop();
                return Err(error);
            }
        }
        Ok(count)
    }

    /// Samples of all shards.
    pub fn samples(&self) -> u64 {
        self.shards
            .last()
            .map_or(0, |last| last.first + last.samples.len() as u64)
    }

    /// Reads sample `number`, counted from 0 over all shards in the order of adding. Its truth is rounded (see
    /// [`crate::write_shard`]).
    ///
    /// # Errors
    /// [`FormatError::NoSuchSample`]; [`FormatError::File`] when the shard can no longer be read, the sample cannot be
    /// decoded or was taken by another camera.
    pub fn record(&self, number: u64) -> Result<SampleRecord, FormatError> {
        let after = self.shards.partition_point(|shard| shard.first <= number);
        let found = after.checked_sub(1).and_then(|at| {
            let shard = &self.shards[at];
            let within = usize::try_from(number - shard.first).ok()?;
            Some((shard, shard.samples.get(within)?))
        });
        let samples = self.samples();
        let (shard, bytes) = found.ok_or(FormatError::NoSuchSample { number, samples })?;
        let path = &shard.path;
        let record = read(path, bytes).map_err(|error| FormatError::unreadable(path, error))?;
        if let Some((seed, first)) = shard.described {
            record
                .check_described(seed, first.saturating_add(number - shard.first))
                .map_err(|error| FormatError::unreadable(path, error))?;
        }
        if record.sample.camera != self.camera {
            let index = record.index;
            let reason = format!("sample {index} was taken by another camera than the one expected");
            return Err(FormatError::unreadable(path, reason));
        }
        Ok(record)
    }
}

/// Where the samples of the shard at `path` lie: from the header of the first entry of each to the end of its last.
fn positions(path: &Path) -> Result<Vec<Range<u64>>, FormatError> {
    let file = File::open(path)?;
    let length = file.metadata()?.len();
    let mut archive = tar::Archive::new(file);
    let mut pending = PendingSample::default();
    let mut samples = Vec::new();
    for entry in archive.entries_with_seek()? {
        let sample = pending.take(entry?, |entry, name| {
            let (content, expected) = (entry.raw_file_position(), entry.size());
            let actual = length.saturating_sub(content);
            if actual < expected {
                return Err(FormatError::truncated(name, actual, expected));
            }
            Ok(entry.raw_header_position()..content + expected)
        })?;
        if let Some((_, [a, b, c, d])) = sample {
            // The parts follow one another, in whatever order.
            let start = a.start.min(b.start).min(c.start.min(d.start));
            let end = a.end.max(b.end).max(c.end.max(d.end));
            samples.push(start..end);
        }
    }
    pending.finish()?;
    Ok(samples)
}

/// The sample in `bytes` of the shard at `path`: they are a shard of one sample.
fn read(path: &Path, bytes: &Range<u64>) -> Result<SampleRecord, FormatError> {
    let mut file = File::open(path)?;
    file.seek(SeekFrom::Start(bytes.start))?;
    let mut reader = ShardReader::new(file.take(bytes.end - bytes.start));
    let record = reader.records()?.next();
    // Nothing is there when the file has become shorter.
    record.unwrap_or_else(|| Err(std::io::Error::from(std::io::ErrorKind::UnexpectedEof).into()))
}
