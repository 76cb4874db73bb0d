//! Fitting: the mesh that explains the image.
//!
//! A finder gives a [`Start`], maps or a mesh. [`FrameFitter`] fits the template's mesh to it and to the image itself, under
//! isometry, and answers with a [`Surface`](crate::Surface):
//!
//! 1. [`measurements`]: registered points with depth; of maps away from edges and breaks.
//! 2. From maps: rigid alignment, then a solve with reprojection, depth prior, isometry and bending. A mesh is there already.
//! 3. Photo-consistency solves, coarse to fine. The mesh is drawn with its print; drawing and image are normalised locally,
//!    so that light drops out; the mesh moves until they agree. Where the margin is blank, its border is held to the paper's.
//! 4. Again from another bend: a sheet that may stretch tells the registration, whose derivatives tell depth without a guess (differential
//!    Shape-from-Template). What the image confirms more is kept.
//! 5. From a mesh, where the print is similar to itself, shifted or turned: the places that look alike are tried too, for matches
//!    may have led to the wrong one.
//! 6. On request, of a single image of a sheet: other shapes along the softest modes of the fit; what the image confirms more is kept.
//!    Then the same in close-ups, the part of the camera's own image around the sheet, at growing resolution.
//! 7. The verdict: how far the image shows the print where the mesh puts it.

mod border;
mod cage;
mod close_up;
mod coarse_fitter;
mod correlation;
mod deviations;
mod frame_fitter;
mod grid_interpolation;
mod isometric_mesh;
mod low_modes;
pub(crate) mod measurements;
pub(crate) mod mesh_fitter;
mod mode_hops;
mod print;
mod rigid_fit;
mod self_similarity;
pub mod tracking;

pub use crate::mesh::SurfaceLocator;
pub use frame_fitter::FrameFitter;
pub use grid_interpolation::{GridInterpolation, catmull_rom};
pub use isometric_mesh::{IsometricMesh, Stiffness};
pub use measurements::{Measurement, Start, measurements};
