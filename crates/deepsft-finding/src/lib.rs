//! Finds printed pictures in camera images without any training.
//!
//! 1. [`PictureTarget`]: corners of the picture at many sizes, with binary descriptors. Made once.
//! 2. [`Features`]: the same of a camera image.
//! 3. Matches, and of these the ones that their neighbours confirm. Neighbours on a bent sheet move alike,
//!    wherever they are: no homography is assumed.
//! 4. A mesh of the sheet, fitted to the confirmed matches under isometry.
//! 5. More matches, looked for where this mesh has them, and the mesh fitted again.

#![cfg_attr(test, allow(clippy::unwrap_used, clippy::expect_used, clippy::panic))]

mod consensus;
mod corners;
mod descriptor;
mod features;
mod finder;
mod matching;
mod pyramid;
mod sheet_pose;
mod target;

pub use features::{FeatureOptions, Features};
pub use finder::{FeatureFinder, FoundSheet};
pub use target::PictureTarget;
