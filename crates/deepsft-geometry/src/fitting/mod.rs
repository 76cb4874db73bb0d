//! Fitting: the mesh that explains the image.
//!
//! The network finds the object. [`FrameFitter`] then fits the template's mesh to the network's maps and to the image
//! itself, under isometry:
//!
//! 1. [`measurements`]: registered pixels with depth, away from edges and breaks of the maps.
//! 2. Rigid alignment, then a solve with reprojection, depth prior, isometry and bending.
//! 3. Photo-consistency solves, coarse to fine. The mesh is drawn with its print; drawing and image are normalised locally,
//!    so that light drops out; the mesh moves until they agree.
//! 4. Where the print repeats itself or looks the same when turned, the places that look alike are tried too: features may
//!    have slipped.
//! 5. The maps are drawn from the mesh. Where they explain the image no better than the network's maps, the network's stay.

mod agreement;
mod frame_fitter;
mod level;
mod lookalikes;
mod measurements;
pub(crate) mod mesh_fitter;
mod options;
mod print;
mod rigid_fit;
mod slips;
pub mod tracking;

pub use crate::mesh::SurfaceLocator;
pub use frame_fitter::{FrameFit, FrameFitter, PhotoConsistencyCost};
// For our other crates and tests; no stable interface.
#[doc(hidden)]
pub use level::IsometricMesh;
#[doc(hidden)]
pub use measurements::{Measurement, measurements};
pub use options::FitOptions;
