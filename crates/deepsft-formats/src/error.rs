//! The one error type of this crate.

use deepsft_geometry::{GeometryError, TemplateError};
#[cfg(feature = "fs")]
use std::path::Path;
use std::path::PathBuf;

/// What can go wrong between bytes and cameras, meshes, pictures, templates and samples.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum FormatError {
    /// Geometry refused a camera, map or picture.
    #[error(transparent)]
    Geometry(#[from] GeometryError),
    /// A mesh or template cannot be used.
    #[error(transparent)]
    Template(#[from] TemplateError),
    /// The content of a `camera.json` cannot be read.
    #[error("camera description cannot be read: {reason}")]
    CameraFile {
        /// What the reader met, and where.
        reason: String,
    },
    /// The content of a `template.json` cannot be read.
    #[error("template description cannot be read: {reason}")]
    TemplateFile {
        /// What the reader met, and where.
        reason: String,
    },
    /// A line of an OBJ file cannot be read.
    #[error("line {line} of the mesh is not understood: {reason}")]
    Obj {
        /// Number of the line, from 1.
        line: usize,
        /// What is wrong with it.
        reason: String,
    },
    /// The mesh of a template is not one of ours.
    #[error("the template's mesh has a corner whose position and texture coordinates have different numbers")]
    TemplateMesh,
    /// A scan cannot be made a template.
    #[error("{reason}")]
    Scan {
        /// What is wrong with it.
        reason: String,
    },
    /// A template was written in another version of the format.
    #[error("template has format version {actual}, this program reads version {expected}")]
    TemplateVersion {
        /// Version met.
        actual: u32,
        /// Version this crate reads.
        expected: u32,
    },
    /// A picture's file has 0 bytes.
    #[error("picture file is empty (0 bytes)")]
    PictureFileEmpty,
    /// A picture has more pixels than is decoded.
    #[error("picture of {width} x {height} pixels is too large: {limit}")]
    PictureTooLarge {
        /// Columns met.
        width: u32,
        /// Rows met.
        height: u32,
        /// The limit that it passes.
        limit: String,
    },
    /// A picture's file is of an unknown kind, cut short or corrupt.
    #[error("picture cannot be read: {reason}")]
    PictureFile {
        /// What the decoder met.
        reason: String,
    },
    /// An array does not have as many values as its shape says.
    #[error("{actual} values for an array of the shape {shape:?}")]
    ValueCount {
        /// Values met.
        actual: usize,
        /// The shape.
        shape: Vec<usize>,
    },
    /// A part of a data set is none.
    #[error("expected I/N with I from 1 to N, like 2/8")]
    DatasetPart,
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
    /// An entry of a shard, a picture or a description is foreign, there twice, cut or not what it should be.
    #[error("shard entry {name} {reason}")]
    Entry {
        /// Name of the entry.
        name: String,
        /// What is wrong with it: "is 12 bytes, expected 34".
        reason: String,
    },
    /// A sample in a shard is not complete.
    #[error("sample {key} of the shard has no {part}")]
    MissingPart {
        /// Number of the sample within the shard.
        key: String,
        /// Ending of the missing entry.
        part: &'static str,
    },
    /// A sample was asked for that the shards do not have.
    #[error("there is no sample {number}, only {samples}")]
    NoSuchSample {
        /// Number asked for, from 0.
        number: u64,
        /// Samples of all shards.
        samples: u64,
    },
    /// A shard holds another sample than its data set's description says.
    #[error(
        "the shard holds sample {index} of seed {seed} where the data set's description has sample {expected_index} of \
         seed {expected_seed}"
    )]
    OtherSample {
        /// Seed met.
        seed: u64,
        /// Index met.
        index: u64,
        /// Seed of the description.
        expected_seed: u64,
        /// Index by the description.
        expected_index: u64,
    },
    /// A depth that the 16-bit file format cannot hold.
    #[error("depth of {depth_mm} mm in sample {index}, the file format holds 0.1 to 6553.5 mm")]
    DepthRange {
        /// The depth, mm.
        depth_mm: f32,
        /// Index of the sample.
        index: u64,
    },
    /// A file or folder cannot be used.
    #[error("{reason}: {path}")]
    File {
        /// What is wrong with it.
        reason: String,
        /// The file or folder.
        path: PathBuf,
    },
    /// A file or folder could not be written.
    #[error("could not write {path}: {reason}")]
    Write {
        /// What the system says.
        reason: String,
        /// The file or folder.
        path: PathBuf,
    },
    /// Another process works on a folder.
    #[error("another process is at work on this folder; wait until it ends: {path}")]
    Locked {
        /// The folder.
        path: PathBuf,
    },
    /// A folder is in the way.
    #[error("{path} exists and holds no {markers}: choose another folder, or remove it")]
    ForeignFolder {
        /// The files by which a folder of the wanted kind is known.
        markers: String,
        /// The folder.
        path: PathBuf,
    },
    /// An input is missing, corrupt or unfit.
    #[error("cannot use {what} {path}: {reason}")]
    Unusable {
        /// What it should be.
        what: &'static str,
        /// The file or folder.
        path: PathBuf,
        /// What is wrong with it.
        reason: String,
    },
    /// A data set is not of the template that it is to be used for.
    #[error("it is of another template: {difference}")]
    OtherTemplate {
        /// In what they differ.
        difference: String,
    },
}

impl FormatError {
    /// The error of a picture's file.
    pub(crate) fn picture(reason: impl ToString) -> Self {
        let reason = reason.to_string();
        Self::PictureFile { reason }
    }

    /// The error of an entry that can be read and is wrong.
    pub(crate) fn entry(name: impl Into<String>, reason: impl Into<String>) -> Self {
        let (name, reason) = (name.into(), reason.into());
        Self::Entry { name, reason }
    }

    /// The error of an entry that has fewer bytes than its header announces.
    #[cfg(feature = "shards")]
    pub(crate) fn truncated(name: String, actual: u64, expected: u64) -> Self {
        Self::entry(name, format!("has {actual} bytes, expected {expected}"))
    }
}

#[cfg(feature = "fs")]
impl FormatError {
    /// The error of an input that cannot be used, a `what` ("camera file").
    pub fn unusable(what: &'static str, path: &Path, reason: impl ToString) -> Self {
        Self::Unusable {
            what,
            path: path.to_path_buf(),
            reason: reason.to_string(),
        }
    }

    /// The error of a file or folder that cannot be used.
    pub(crate) fn unreadable(path: &Path, reason: impl ToString) -> Self {
        Self::File {
            reason: reason.to_string(),
            path: path.to_path_buf(),
        }
    }

    /// The error of a file or folder that could not be written.
    pub(crate) fn unwritten(path: &Path, reason: impl ToString) -> Self {
        Self::Write {
            reason: reason.to_string(),
            path: path.to_path_buf(),
        }
    }
}
