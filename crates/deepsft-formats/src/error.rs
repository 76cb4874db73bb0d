//! The one error type of this crate.

use deepsft_geometry::{GeometryError, TemplateError};
#[cfg(feature = "fs")]
use std::path::Path;
use std::path::PathBuf;

/// What can go wrong between bytes and cameras, meshes, pictures and templates.
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
    #[error("camera description cannot be read: {0}")]
    CameraFile(String),
    /// The content of a `template.json` cannot be read.
    #[error("template description cannot be read: {0}")]
    TemplateFile(String),
    /// A line of an OBJ file cannot be read.
    #[error("line {line} of the mesh is not understood: {reason}; export it again")]
    Obj {
        /// Number of the line, from 1.
        line: usize,
        /// What is wrong with it.
        reason: String,
    },
    /// A scan cannot be made a template.
    #[error("{0}")]
    Scan(String),
    /// A template was written in another version of the format.
    #[error("template has format version {actual}, this program reads version {expected}: use a newer version of it")]
    TemplateVersion {
        /// Version met.
        actual: u32,
        /// Version this crate reads.
        expected: u32,
    },
    /// An `.npy` file cannot be read.
    #[error("array cannot be read: {0}")]
    Npy(String),
    /// The values of an array do not fill its rows.
    #[error("the values do not fill rows of shape {0:?}")]
    ValueCount(Vec<usize>),
    /// A picture's file is empty, of an unknown kind, too large, cut short or corrupt, or a picture is unfit to be written.
    #[error("picture cannot be read: {0}")]
    PictureFile(String),
    /// A file or folder cannot be used.
    #[error("{path}: {reason}")]
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
}

impl FormatError {
    /// The error of a picture's file.
    pub(crate) fn picture(reason: impl ToString) -> Self {
        Self::PictureFile(reason.to_string())
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
    pub fn unreadable(path: &Path, reason: impl ToString) -> Self {
        Self::File {
            reason: reason.to_string(),
            path: path.to_path_buf(),
        }
    }

    /// The error of a file or folder that could not be written.
    pub fn unwritten(path: &Path, reason: impl ToString) -> Self {
        Self::Write {
            reason: reason.to_string(),
            path: path.to_path_buf(),
        }
    }
}
