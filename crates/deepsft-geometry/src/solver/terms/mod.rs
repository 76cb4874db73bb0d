//! The terms of the energy, one a file.

mod bending;
mod depth_prior;
mod isometry;
mod photo_consistency;
mod reprojection;
mod rigidity;

pub use bending::Bending;
pub(crate) use bending::cotangent;
pub use depth_prior::{DepthPrior, PointDepth};
pub use isometry::Isometry;
pub use photo_consistency::{PhotoConsistency, TexturePoint};
pub use reprojection::{ImagePoint, Reprojection};
pub(crate) use rigidity::Rigidity;
