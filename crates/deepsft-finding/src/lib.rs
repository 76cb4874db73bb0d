#![doc = include_str!("../README.md")]
//!
//! # How it finds
//!
//! 1. [`FeatureFinder::new`] takes corners of the picture at many sizes, with binary descriptors. Made once per picture.
//! 2. [`Features`]: the same of a camera image. Made once per image, for all targets.
//! 3. [`FeatureFinder::find`] matches both and keeps the matches that their neighbours confirm. Neighbours on a bent sheet move alike,
//!    wherever they are: no homography is assumed.
//! 4. It fits a coarse mesh of the sheet to the confirmed matches under isometry, looks for more matches where this mesh has
//!    them, and fits again.
//!
//! The result is that coarse mesh. [`deepsft_geometry::fitting::FrameFitter`] takes it on to the exact one, and its verdict
//! tells whether the picture is there at all.

#![cfg_attr(test, allow(clippy::unwrap_used, clippy::expect_used, clippy::panic))]

mod consensus;
mod corners;
mod descriptor;
mod features;
mod finder;
mod grade;
mod matching;
mod pyramid;
mod shape_solver;
mod solid_grade;
mod target;

pub use features::Features;
pub use finder::{FeatureFinder, FoundMesh};
pub use grade::{GradeLevel, PictureGrade};
pub use matching::Match;
pub use solid_grade::{SolidGrade, solid_sides};
