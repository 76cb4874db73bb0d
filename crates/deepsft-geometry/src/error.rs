//! The error of cameras, pictures, maps and fits.

use crate::image::ImageSize;
use crate::template_error::TemplateError;
use glam::DVec3;
use thiserror::Error;

/// What is wrong with a camera, a picture, a pair of maps or a fit.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum GeometryError {
    /// A mesh or template cannot be used.
    #[error(transparent)]
    Template(#[from] TemplateError),
    /// An intrinsic parameter is not a number a camera can have.
    #[error("camera {parameter} is {actual}, expected {expected}")]
    CameraParameter {
        /// Name as in `camera.json`: `fx`, `cy`, `k1`, ...
        parameter: &'static str,
        /// The value met.
        actual: f64,
        /// What would have been accepted.
        expected: &'static str,
    },
    /// A picture has no pixels, or its buffer does not have the size its width and height ask for.
    #[error("picture of {size} pixels has {actual} bytes, expected at least 1 pixel and 3 bytes for each")]
    PictureSize {
        /// Size of the picture.
        size: ImageSize,
        /// Bytes met.
        actual: usize,
    },
    /// A weight, deviation or robust scale is not a number it can be.
    #[error(
        "{term} has a weight or scale of {actual}, expected a finite number that is not negative (scales: positive)"
    )]
    Weight {
        /// Name of the term.
        term: &'static str,
        /// The value met.
        actual: f64,
    },
    /// A mesh has no edge of positive length, so nothing to measure by.
    #[error("mesh has no edge of positive length")]
    MeshWithoutExtent,
    /// A start shape does not have the template's number of vertices.
    #[error("start has {actual} vertices, the template {expected}")]
    StartLength {
        /// Vertices met.
        actual: usize,
        /// Vertices of the template.
        expected: usize,
    },
    /// A term is not defined at the start shape (a start that is no number).
    #[error("{term} has the energy {energy} at the start, expected a finite one")]
    StartEnergy {
        /// Name of the term.
        term: &'static str,
        /// Its energy.
        energy: f64,
    },
    /// A term couples vertices that the solver was not prepared for.
    #[error("{term} couples vertices that the solver was not made for, or that are not there")]
    Coupling {
        /// Name of the term.
        term: &'static str,
    },
    /// A network's rest positions were to be read without the template that they are of.
    #[error("the network says rest positions, and there is no template to find them on")]
    NoRestSurface,
    /// No vertex is visible: nothing says where the object is.
    #[error("no vertex is visible")]
    NoVisibleVertex,
    /// A matrix that must be positive definite is not, numerically, or its factorisation does not fit into memory.
    #[error("system of {unknowns} unknowns is numerically singular or too large")]
    Singular {
        /// Number of unknowns.
        unknowns: usize,
    },
    /// An operation that only a flat sheet's regular grid allows.
    #[error("{operation} needs a template that is a flat sheet; this one is a mesh")]
    NotASheet {
        /// What was asked for.
        operation: &'static str,
    },
    /// A picture or maps do not have the size of what they belong to.
    #[error("image or maps of {actual} pixels, expected {expected}")]
    MapSize {
        /// Size met.
        actual: ImageSize,
        /// Size expected.
        expected: ImageSize,
    },
}

/// Refuses a start shape that does not have the `expected` number of vertices.
pub(crate) fn check_start(start: &[DVec3], expected: usize) -> Result<(), GeometryError> {
    let actual = start.len();
    if actual == expected {
        Ok(())
    } else {
        Err(GeometryError::StartLength { actual, expected })
    }
}

/// Refuses pictures and maps of a size that is not the `expected` one.
///
/// # Errors
/// [`GeometryError::MapSize`].
pub fn check_size(actual: impl Into<ImageSize>, expected: impl Into<ImageSize>) -> Result<(), GeometryError> {
    let (actual, expected) = (actual.into(), expected.into());
    if actual == expected {
        Ok(())
    } else {
        Err(GeometryError::MapSize { actual, expected })
    }
}
