//! What can go wrong in synthesis and data sets.

use deepsft_formats::FormatError;
use deepsft_geometry::{GeometryError, Lens, TemplateError};
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
        /// The lens as given.
        actual: Lens,
    },
    /// A mesh to be rendered does not fit the template.
    #[error("{actual} vertices to render, expected the template's {expected}")]
    VertexCount {
        /// Vertices as given.
        actual: usize,
        /// Vertices of the template.
        expected: usize,
    },
    /// The beginning of another data set is in the way.
    #[error("{folder} holds the beginning of another data set ({difference}): ask for that one, or remove it")]
    OtherDataset {
        /// In what that one differs.
        difference: String,
        /// Where it is.
        folder: PathBuf,
    },
    /// A part of a data set is none.
    #[error("expected I/N with I from 1 to N, like 2/8")]
    DatasetPart,
    /// A data set is not of the template that it is to be used for.
    #[error("it is of another template: {difference}; choose a set of this one")]
    OtherTemplate {
        /// In what they differ.
        difference: String,
    },
    /// A depth that the 16-bit file format cannot hold.
    #[error("depth of {depth_mm} mm in sample {index}, the file format holds 0.1 to 6553.5 mm")]
    DepthRange {
        /// The depth, mm.
        depth_mm: f32,
        /// Index of the sample.
        index: u64,
    },
    /// An entry of a sample that cannot be coded.
    #[error("{entry} of sample {index} cannot be written: {reason}")]
    Entry {
        /// Its name's ending.
        entry: &'static str,
        /// Index of the sample.
        index: u64,
        /// What is wrong with it.
        reason: String,
    },
    /// A recording's `camera.json` cannot be used.
    #[error("{reason}")]
    Sensor {
        /// What is wrong with it.
        reason: String,
    },
    /// Nothing of this name happens in clips.
    #[error("expected one of {expected}")]
    ClipEvent {
        /// The names there are.
        expected: String,
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
