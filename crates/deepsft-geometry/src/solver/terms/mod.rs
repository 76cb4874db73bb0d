//! The terms of the energy, one a file.

mod arap;
pub(crate) mod arap_cells;
mod bending;
mod depth_prior;
mod isometry;
mod photo_consistency;
mod reprojection;

pub use arap::{Arap, PAPER_ARAP_WEIGHT, PAPER_SMOOTHNESS_WEIGHT};
pub use bending::Bending;
pub use depth_prior::{DepthPrior, PointDepth};
pub use isometry::Isometry;
pub use photo_consistency::{PhotoConsistency, TexturePoint};
pub use reprojection::{ImagePoint, Reprojection};
