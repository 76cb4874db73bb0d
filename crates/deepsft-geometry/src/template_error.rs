//! The error of meshes and templates.

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
    /// A print has a size that no print has.
    #[error("print is {width} x {height} mm, expected sides from {shortest} to {longest} mm")]
    PrintSize {
        /// Width met, mm.
        width: f64,
        /// Height met, mm.
        height: f64,
        /// Shortest side allowed, mm.
        shortest: f64,
        /// Longest side allowed, mm.
        longest: f64,
    },
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
    /// A texture coordinate of a template's mesh lies outside the texture.
    #[error("vertex {vertex} has the texture coordinates ({u}, {v}), expected both between 0 and 1")]
    TextureOutside {
        /// Index of the vertex.
        vertex: usize,
        /// Its u.
        u: f64,
        /// Its v.
        v: f64,
    },
    /// Two neighbouring faces of a template's mesh have their fronts on different sides.
    #[error("faces {first} and {second} share an edge and have their fronts on different sides of the surface")]
    FaceOrientation {
        /// Index of one face.
        first: usize,
        /// Index of the other.
        second: usize,
    },
    /// Parts of a template's surface share one place of the texture, so a registration would not tell them apart.
    #[error(
        "{percent:.1} % of the used texture belongs to more than one part of the surface: a registration could not \
         tell them apart"
    )]
    ChartsOverlap {
        /// Fraction of the used texture, percent.
        percent: f64,
    },
}
