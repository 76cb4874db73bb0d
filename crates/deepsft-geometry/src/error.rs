//! The one error type of this crate.

use thiserror::Error;

/// What is wrong with a camera, a mesh, a picture or a pair of maps.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum GeometryError {
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
    /// A picture's buffer does not have the size its width and height ask for.
    #[error("picture of {width} x {height} pixels has {actual} bytes, expected {expected}")]
    PictureSize {
        /// Columns.
        width: usize,
        /// Rows.
        height: usize,
        /// Bytes met.
        actual: usize,
        /// Bytes expected: 3 a pixel.
        expected: usize,
    },
    /// A picture has no pixels.
    #[error("picture is empty ({width} x {height} pixels)")]
    PictureEmpty {
        /// Columns.
        width: usize,
        /// Rows.
        height: usize,
    },
    /// A template's size in millimetres is not positive and finite.
    #[error("template {side} is {actual} mm, expected a positive finite length")]
    TemplateSize {
        /// `width` or `height`.
        side: &'static str,
        /// The length met, mm.
        actual: f64,
    },
    /// A face names a vertex that is not there.
    #[error("face {face} names vertex {vertex}, the mesh has {vertices}")]
    FaceIndex {
        /// Index of the face.
        face: usize,
        /// The vertex it names.
        vertex: usize,
        /// Number of vertices.
        vertices: usize,
    },
    /// A vertex or texture coordinate is not finite.
    #[error("vertex {vertex} is not finite")]
    VertexNotFinite {
        /// Index of the vertex.
        vertex: usize,
    },
    /// Per-vertex arrays differ in length.
    #[error("mesh has {actual} texture coordinates, expected one for each of {expected} vertices")]
    TextureCoordinates {
        /// Number of texture coordinates.
        actual: usize,
        /// Number of vertices.
        expected: usize,
    },
    /// Two maps that are compared have different sizes.
    #[error("maps of {actual:?} pixels (width, height), expected {expected:?}")]
    MapSize {
        /// Size met.
        actual: (usize, usize),
        /// Size expected.
        expected: (usize, usize),
    },
}
