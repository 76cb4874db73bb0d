//! Cameras, meshes, templates, maps, the mesh solver and metrics of Shape-from-Template: pure maths.
//!
//! # Conventions, fixed once for the whole project
//!
//! * **Frames.** *Template* (the rest shape), *camera* (x right, y down, z forward), *image* (pixels,
//!   origin at the top-left corner, the first pixel's centre at (0.5, 0.5)), *texture* ((u, v) in the
//!   unit square, v down). `camera_from_template` maps template points to camera points; points carry
//!   their frame in their name (`p_camera`, `vertices_template`).
//! * **A flat thin shell** lies in the plane z = 0 of its template frame, centred on the origin, x
//!   right and y down as on the printed sheet, so the identity rotation shows it frontal and
//!   unmirrored: u = x / width + 1/2, v = y / height + 1/2. Its front faces -z.
//! * **A template of any other shape** is a triangle mesh of its own template frame, upright objects with their
//!   head towards -y and their face towards -z, so that the identity rotation shows them upright from the front.
//! * **Units.** Lengths are millimetres; angles are radians (`_deg` where a person types them). `f64`
//!   in geometry, `f32` in maps.
//! * **Maps** are row-major, [`CANONICAL_HEIGHT`] rows by [`CANONICAL_WIDTH`] columns. Outside the
//!   object depth is -1 and registration (-1, -1).
//!
//! This crate opens no file, reads no clock and starts no thread.

#![cfg_attr(test, allow(clippy::unwrap_used, clippy::expect_used, clippy::panic))]

mod camera;
mod canonical;
mod color_response;
mod completion;
mod disjoint_sets;
mod error;
mod islands;
mod maps;
mod mesh;
pub mod metrics;
mod photometric;
pub mod physics;
mod picture;
pub mod raster;
mod refinement;
mod rigid_alignment;
mod rotation;
pub mod solver;
mod template;
mod topology;
pub mod tracking;
mod welding;

pub use camera::{Camera, PAPER_CAMERAS};
pub use canonical::{CANONICAL_HEIGHT, CANONICAL_WIDTH, CanonicalWarp, training_camera};
pub use color_response::{ColorMatch, ColorResponse};
pub use completion::{
    ArapCompletion, CompletedMaps, Completion, CompletionEnergy, CompletionOptions, CompletionReport, MapsCompletion,
    VisibleVertices,
};
pub use disjoint_sets::DisjointSets;
pub use error::GeometryError;
pub use glam;
pub use islands::remove_islands;
pub use maps::{Maps, OUTSIDE};
pub use mesh::TriangleMesh;
pub use photometric::{draw_template, mipmap_level, photometric_error, relit_photometric_error};
pub use picture::Picture;
pub use refinement::{RefinedMesh, Refinement};
pub use rigid_alignment::RigidMotion;
pub use template::Template;
pub use topology::{Topology, texture_overlap};
pub use welding::Welding;
