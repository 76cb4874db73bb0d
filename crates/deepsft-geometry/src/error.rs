//! The errors of meshes and templates, and of cameras, pictures, maps and fits.

use crate::image::ImageSize;
use glam::{DVec2, DVec3};
use thiserror::Error;

/// What is wrong with a mesh or a template.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum TemplateError {
    /// A template's size in millimetres is not positive and finite.
    #[error("template {side} is {actual} mm, expected a positive finite length")]
    Size {
        /// `width`, `height` or `diameter`.
        side: &'static str,
        /// The length met, mm.
        actual: f64,
    },
    /// A print has a size that no print has, mm: the size met, and the shortest and longest sides allowed.
    #[error("print is {} x {} mm, expected sides from {} to {} mm", .0.x, .0.y, .1[0], .1[1])]
    PrintSize(DVec2, [f64; 2]),
    /// Per-vertex arrays differ in length.
    #[error("mesh has {actual} texture coordinates, expected one for each of {expected} vertices")]
    TextureCoordinates {
        /// Number of texture coordinates.
        actual: usize,
        /// Number of vertices.
        expected: usize,
    },
    /// A vertex with this index or its texture coordinate is not finite.
    #[error("vertex {0} is not finite")]
    VertexNotFinite(usize),
    /// A face names a vertex that is not there.
    #[error("face {face} names vertex {vertex}, expected one of the mesh's {vertices} (from 0)")]
    FaceIndex {
        /// Index of the face.
        face: usize,
        /// The vertex it names.
        vertex: usize,
        /// Number of vertices.
        vertices: usize,
    },
    /// A template's mesh has no faces.
    #[error("mesh has no faces")]
    MeshWithoutFaces,
    /// The face of a template's mesh with this index has no area.
    #[error("face {0} has no area")]
    DegenerateFace(usize),
    /// The vertex of a template's mesh with this index belongs to no face.
    #[error("vertex {0} belongs to no face")]
    UnusedVertex(usize),
    /// A texture coordinate of the vertex with this index lies outside the texture.
    #[error("vertex {0} has the texture coordinates ({u}, {v}), expected both between 0 and 1", u = .1.x, v = .1.y)]
    TextureOutside(usize, DVec2),
    /// Two neighbouring faces of a template's mesh, with these indices, have their fronts on different sides.
    #[error("faces {0} and {1} share an edge and have their fronts on different sides of the surface")]
    FaceOrientation(usize, usize),
    /// Parts of a template's surface share so much of the used texture, percent: a registration would not tell them apart.
    #[error(
        "{0:.1} % of the used texture belongs to more than one part of the surface: a registration could not tell them \
         apart"
    )]
    ChartsOverlap(f64),
}

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
    /// The term of this name couples vertices that the solver was not prepared for.
    #[error("{0} couples vertices that the solver was not made for, or that are not there")]
    Coupling(&'static str),
    /// A network's rest positions were to be read without the template that they are of.
    #[error("the network says rest positions, and there is no template to find them on")]
    NoRestSurface,
    /// No vertex is visible: nothing says where the object is.
    #[error("no vertex is visible")]
    NoVisibleVertex,
    /// The matrix of so many unknowns is not positive definite, numerically, or its factorisation does not fit into memory.
    #[error("system of {0} unknowns is numerically singular or too large")]
    Singular(usize),
    /// This operation needs a flat sheet's regular grid.
    #[error("{0} needs a template that is a flat sheet; this one is a mesh")]
    NotASheet(&'static str),
    /// A picture or maps do not have the size of what they belong to.
    #[error("image or maps of {actual} pixels, expected {expected}")]
    MapSize {
        /// Size met.
        actual: ImageSize,
        /// Size expected.
        expected: ImageSize,
    },
}

/// The result of cameras, pictures, maps and fits.
pub(crate) type Result<T, E = GeometryError> = std::result::Result<T, E>;

/// Refuses a start shape that does not have the `expected` number of vertices.
pub(crate) fn check_start(start: &[DVec3], expected: usize) -> Result<()> {
    let actual = start.len();
    let fits = actual == expected;
    fits.then_some(())
        .ok_or(GeometryError::StartLength { actual, expected })
}

/// Refuses pictures and maps of a size that is not the `expected` one.
///
/// # Errors
/// [`GeometryError::MapSize`].
pub fn check_size(actual: impl Into<ImageSize>, expected: impl Into<ImageSize>) -> Result<()> {
    let (actual, expected) = (actual.into(), expected.into());
    let fits = actual == expected;
    fits.then_some(()).ok_or(GeometryError::MapSize { actual, expected })
}
