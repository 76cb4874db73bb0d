//! What can go wrong in synthesis and data sets.

use deepsft_geometry::GeometryError;
use std::path::{Path, PathBuf};

/// Errors of this crate.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SynthError {
    /// A number of a [`crate::SynthConfig`] lies outside its range.
    #[error("synthesis setting {parameter} is {actual}, expected {expected}")]
    Setting {
        /// Field of the configuration.
        parameter: &'static str,
        /// The value as given.
        actual: String,
        /// What is valid.
        expected: &'static str,
    },
    /// The renderer draws straight edges: the synthesis camera must be free of lens distortion.
    #[error("the synthesis camera has lens distortion {actual:?}, expected none")]
    DistortedCamera {
        /// (k1, k2, p1, p2, k3) as given.
        actual: [f64; 5],
    },
    /// A mesh to be rendered does not fit the template.
    #[error("{actual} vertices to render, expected the template's {expected}")]
    VertexCount {
        /// Vertices as given.
        actual: usize,
        /// Vertices of the template.
        expected: usize,
    },
    /// A shard could not be read or written.
    #[error("shard: {0}")]
    Io(#[from] std::io::Error),
    /// A picture in a shard could not be coded or decoded.
    #[error("shard entry {name}: {source}")]
    EntryPicture {
        /// Name of the entry.
        name: String,
        /// The codec's error.
        source: image::ImageError,
    },
    /// The description of a sample or a data set is not the JSON it should be.
    #[error("{name}: {source}")]
    Json {
        /// Name of the entry or file.
        name: String,
        /// The parser's error.
        source: serde_json::Error,
    },
    /// A shard holds something that is no part of a sample.
    #[error("shard entry {name} is not NNNNNN.rgb.png, .depth.png, .uv.png or .json")]
    ForeignEntry {
        /// Name of the entry.
        name: String,
    },
    /// A shard holds the same part of a sample twice.
    #[error("shard entry {name} is there twice")]
    RepeatedEntry {
        /// Name of the entry.
        name: String,
    },
    /// A sample in a shard is not complete.
    #[error("sample {key} of the shard has no {part}")]
    MissingPart {
        /// Number of the sample within the shard.
        key: String,
        /// Ending of the missing entry.
        part: &'static str,
    },
    /// A shard ends within an entry.
    #[error("shard entry {name} has {actual} bytes, expected {expected}")]
    TruncatedEntry {
        /// Name of the entry.
        name: String,
        /// Bytes that were there.
        actual: u64,
        /// Bytes that its header announces.
        expected: u64,
    },
    /// An entry of a shard can be decoded but is not what it should be.
    #[error("shard entry {name} is {actual}, expected {expected}")]
    EntryContent {
        /// Name of the entry.
        name: String,
        /// What was found.
        actual: String,
        /// What should be there.
        expected: String,
    },
    /// A file of a data set cannot be used.
    #[error("{reason}: {path}")]
    ShardFile {
        /// What is wrong with it.
        reason: String,
        /// The file.
        path: PathBuf,
    },
    /// A sample was asked for that the shards do not have.
    #[error("there is no sample {number}, only {samples}")]
    NoSuchSample {
        /// Number asked for, from 0.
        number: u64,
        /// Samples of all shards.
        samples: u64,
    },
    /// A depth that the 16-bit file format cannot hold.
    #[error("depth of {depth_mm} mm in sample {index}, the file format holds 0.1 to 6553.5 mm")]
    DepthRange {
        /// The depth, mm.
        depth_mm: f32,
        /// Index of the sample.
        index: u64,
    },
    /// A file of an RGB-D recording cannot be used.
    #[error("{reason}: {path}")]
    Recording {
        /// What is wrong with it.
        reason: String,
        /// The file.
        path: PathBuf,
    },
    /// A camera, mesh, map or picture was refused.
    #[error(transparent)]
    Geometry(#[from] GeometryError),
}

impl SynthError {
    /// The error of a file of a recording.
    pub(crate) fn recording(reason: impl Into<String>, path: &Path) -> Self {
        Self::Recording {
            reason: reason.into(),
            path: path.to_path_buf(),
        }
    }
}
