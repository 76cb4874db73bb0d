//! Fitting: the mesh that explains the image.
//!
//! The network finds the object. [`FrameFitter`] then fits the template's mesh to the network's maps and to the image
//! itself, under isometry:
//!
//! 1. [`measurements`]: registered pixels with depth, away from edges and breaks of the maps.
//! 2. Rigid alignment, then a solve with reprojection, depth prior, isometry and bending.
//! 3. Photo-consistency solves, coarse to fine. The mesh is drawn with its print; drawing and image are normalised locally,
//!    so that light drops out; the mesh moves until they agree.
//! 4. Where the print is similar to itself, shifted or turned, the places that look alike are tried too: the fit may be in
//!    the wrong mode.
//! 5. The maps are drawn from the mesh. Where they explain the image no better than the network's maps, the network's stay.

mod coarse_fitter;
mod correlation;
mod frame_fitter;
mod grid_interpolation;
mod isometric_mesh;
mod measurements;
pub(crate) mod mesh_fitter;
mod mode_hops;
mod options;
mod print;
mod rigid_fit;
mod self_similarity;
pub mod tracking;

pub use crate::mesh::SurfaceLocator;
pub use frame_fitter::{FrameFit, FrameFitter, PhotoConsistencyCost};
// For our other crates and tests; no stable interface.
#[doc(hidden)]
pub use isometric_mesh::IsometricMesh;
#[doc(hidden)]
pub use measurements::{Measurement, measurements};
pub use options::FitOptions;
