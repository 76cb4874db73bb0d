//! What can go wrong in synthesis and data sets.

use deepsft_formats::FormatError;
use deepsft_geometry::{GeometryError, TemplateError};
use std::path::Path;

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
    /// Something does not fit, in words that say what to do about it.
    #[error("{0}")]
    Refused(String),
    /// A mesh to be rendered does not fit the template.
    #[error("{actual} vertices to render, expected the template's {expected}")]
    VertexCount {
        /// Vertices as given.
        actual: usize,
        /// Vertices of the template.
        expected: usize,
    },
    /// A depth that the 16-bit file format cannot hold.
    #[error("depth of {depth_mm} mm in sample {index}, the file format holds 0.1 to 6553.5 mm")]
    DepthRange {
        /// The depth, mm.
        depth_mm: f32,
        /// Index of the sample.
        index: u64,
    },
    /// A file was refused: one of a recording ([`FormatError::File`]), a photograph ([`FormatError::Unusable`]), or a data
    /// set's.
    #[error(transparent)]
    Format(#[from] FormatError),
    /// A camera, mesh, map or picture was refused.
    #[error(transparent)]
    Geometry(#[from] GeometryError),
    /// A mesh or template cannot be used.
    #[error(transparent)]
    Template(#[from] TemplateError),
}

impl SynthError {
    /// The error of a setting out of its range.
    pub(crate) fn setting(parameter: &'static str, actual: impl ToString, expected: &'static str) -> Self {
        let actual = actual.to_string();
        Self::Setting {
            parameter,
            actual,
            expected,
        }
    }

    /// The error of a file of a recording.
    pub(crate) fn recording(reason: impl ToString, path: &Path) -> Self {
        let (reason, path) = (reason.to_string(), path.to_path_buf());
        FormatError::File { reason, path }.into()
    }
}
