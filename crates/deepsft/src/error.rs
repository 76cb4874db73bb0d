//! The one error type of this crate.

use deepsft_formats::FormatError;
use deepsft_geometry::{GeometryError, TemplateError};
use deepsft_inference::{DeviceKind, UnknownDevice};
use thiserror::Error;

/// What can go wrong between bytes and maps.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum DeepSftError {
    /// Geometry refused a camera, picture or fit.
    #[error(transparent)]
    Geometry(#[from] GeometryError),
    /// A mesh or template cannot be used.
    #[error(transparent)]
    Template(#[from] TemplateError),
    /// A camera, template or picture cannot be read.
    #[error(transparent)]
    Format(FormatError),
    /// A model bundle was written in another version of the format.
    #[error(
        "model bundle has format version {actual}, this program reads version {expected}: use a newer version of it"
    )]
    BundleVersion {
        /// Version met.
        actual: u32,
        /// Version this crate reads.
        expected: u32,
    },
    /// The file of a model bundle with this name is missing.
    #[error("model bundle lacks {0}: fetch it anew, or name its folder")]
    BundleFileMissing(String),
    /// A file of a model bundle is cut short or too long.
    #[error(
        "{file} of the model bundle has {actual} bytes, expected {expected}: it was not stored or fetched whole, fetch it again"
    )]
    BundleFileSize {
        /// Its name in the bundle.
        file: String,
        /// Bytes met.
        actual: u64,
        /// Bytes that `model.json` lists.
        expected: u64,
    },
    /// The file of a model bundle with this name was altered.
    #[error(
        "{0} of the model bundle is not the file that was published: its SHA-256 differs from the listed one, fetch it again"
    )]
    BundleFileHash(String),
    /// The content of a file of a model bundle does not fit.
    #[error("{file} of the model bundle cannot be used: {reason}")]
    BundleContent {
        /// Its name in the bundle.
        file: String,
        /// What does not fit.
        reason: String,
    },
    /// A file of weights cannot be read, or weights cannot be written as one.
    #[error("{0}")]
    Weights(String),
    /// The device failed while computing or reading back.
    #[error("the device failed while computing: {0}")]
    Execution(String),
    /// A device's name is none of those there are.
    #[error(transparent)]
    DeviceUnknown(#[from] UnknownDevice),
    /// A device cannot be used in this build or on this machine, or was lost.
    #[error("device {device} is not available: {reason}")]
    DeviceUnavailable {
        /// What was asked for.
        device: DeviceKind,
        /// What the build, the driver or the browser says.
        reason: String,
    },
}

impl DeepSftError {
    /// Makes the error of a file of a model bundle whose content does not fit.
    pub(crate) fn content<E: ToString>(file: &'static str) -> impl Fn(E) -> Self {
        move |reason| Self::BundleContent {
            file: file.to_owned(),
            reason: reason.to_string(),
        }
    }
}

impl From<FormatError> for DeepSftError {
    fn from(error: FormatError) -> Self {
        match error {
            FormatError::Geometry(error) => Self::Geometry(error),
            FormatError::Template(error) => Self::Template(error),
            error => Self::Format(error),
        }
    }
}
