//! Finds printed pictures in camera images, without any training.
//!
//! 1. [`PictureTarget`]: corners of the picture at many sizes, with binary descriptors. Made once per picture.
//! 2. [`Features`]: the same of a camera image. Made once per image, for all targets.
//! 3. [`FeatureFinder`] matches both and keeps the matches that their neighbours confirm. Neighbours on a bent sheet move alike,
//!    wherever they are: no homography is assumed.
//! 4. It fits a coarse mesh of the sheet to the confirmed matches under isometry, looks for more matches where this mesh has
//!    them, and fits again.
//!
//! The result is depth and registration, as a network gives them. [`deepsft_geometry::fitting::FrameFitter`] takes
//! them on to the exact mesh and tells by its agreement with the image whether the picture is there at all.
//!
//! ```
//! use deepsft_finding::{FeatureFinder, FeatureOptions, Features, PictureTarget};
//! use deepsft_geometry::{Camera, Picture, training_camera};
//! # fn main() -> Result<(), deepsft_geometry::GeometryError> {
//! # let (cover, photograph) = (Picture::from_fn(64, 64, |_, _| [0; 3]), Picture::from_fn(960, 540, |_, _| [0; 3]));
//! let mut finder = FeatureFinder::new(PictureTarget::picture(cover, 210.0)?)?;
//! let camera = Camera::typical(960, 540)?;
//! let features = Features::of(&photograph, &FeatureOptions::default());
//! if let Some(sheet) = finder.find(&features, &camera, &training_camera())? {
//!     println!("{} matches agree", sheet.matches.len());
//! }
//! # Ok(())
//! # }
//! ```

#![cfg_attr(test, allow(clippy::unwrap_used, clippy::expect_used, clippy::panic))]

mod consensus;
mod corners;
mod descriptor;
mod features;
mod finder;
mod grade;
mod guided_matching;
mod hamming;
mod matching;
mod pyramid;
mod sheet_solver;
mod target;

pub use features::{FeatureOptions, Features};
pub use finder::{FeatureFinder, FoundSheet, feature_image};
pub use grade::{GradeLevel, PictureGrade};
pub use matching::Match;
pub use target::PictureTarget;
