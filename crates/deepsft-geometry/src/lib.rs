#![doc = include_str!("../README.md")]
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
//! * **Maps** are row-major, [`CANONICAL_HEIGHT`] rows by [`CANONICAL_WIDTH`] columns; of an upright image
//!   [`CANONICAL_WIDTH`] rows by [`CANONICAL_HEIGHT`] columns ([`canonical_camera`]). Outside the object depth is
//!   -1 and registration (-1, -1).
//!
//! This crate opens no file, reads no clock and starts no thread.

#![cfg_attr(test, allow(clippy::unwrap_used, clippy::expect_used, clippy::panic))]

mod calibration;
mod camera;
mod canonical_views;
mod completion;
mod error;
pub mod fitting;
mod flat_print;
mod image;
mod maps;
mod mesh;
mod recovery;
mod sheet_sides;
pub mod solver;
mod surface;
mod unrolling;
mod verdict;

pub use calibration::{CalibratedCamera, SelfCalibration, SelfCalibrationOptions};
pub use camera::{
    CANONICAL_HEIGHT, CANONICAL_WIDTH, Camera, CanonicalWarp, Lens, TRAINING_FOCAL, canonical_camera, least_squares,
    training_camera,
};
pub use canonical_views::CanonicalViews;
pub use completion::{
    ArapCompletion, Completion, CompletionEnergy, CompletionOptions, MapsCompletion, VertexPoint, VisibleVertices,
};
pub use error::{GeometryError, TemplateError, check_size};
pub use fitting::{catmull_rom, tracking};
pub use flat_print::{FlatMedian, FlatPrint};
pub use glam;
pub use image::{GreyMipmap, ImageSize, MipLevel, Picture, Region, luma, turned_clockwise};
pub use maps::{
    ColorMatch, ColorResponse, Maps, OUTSIDE, draw_template, metrics, mipmap_level, photo_consistency_error, raster,
    relit_photo_consistency_error, remove_islands, visible_surface,
};
pub use mesh::{
    DisjointSets, RestSurface, RigidMotion, Side, Template, Topology, TriangleMesh, Welding, rows_within,
    texture_barycentric,
};
pub use recovery::MeshRecovery;
pub use surface::{Evidence, Surface};
pub use unrolling::{UnrollError, UnrolledSheet, unroll};
pub use verdict::Verdict;
