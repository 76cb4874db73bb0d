//! The mesh solver: a template's vertices that minimise a sum of energies.
//!
//! [`MeshSolver`] is Levenberg-Marquardt in f64 with sparse Cholesky. Its symbolic work is done once a
//! template; terms are small types that implement [`Energy`] and are added by standing in one list:
//!
//! | term | what it holds | residual |
//! |---|---|---|
//! | [`PointData`] | visible vertices at 3D points (the paper's E_data) | lengths / mean edge length |
//! | [`Reprojection`] | registered points at pixels, robust | pixels |
//! | [`Photometric`] | the template's texture on the image, robust | local deviations of grey |
//! | [`DepthPrior`] | depths with their uncertainty, robust | standard deviations |
//! | [`Isometry`] | edge lengths | lengths / mean edge length |
//! | [`Arap`] | local rigidity and smoothness (the paper's E_arap, E_smooth) | lengths / mean edge length |
//! | [`Bending`] | flatness of a thin shell | none (curvature integral) |
//!
//! Nothing depends on the unit of length: a template in metres and one in millimetres give the same
//! shape with the same weights. When only 3D points and ARAP are wanted,
//! [`ArapCompletion`](crate::ArapCompletion) minimises the same energy several times faster.

mod arap;
pub(crate) mod arap_prior;
mod bending;
pub(crate) mod checked;
pub(crate) mod cholesky;
mod depth_prior;
mod energy;
mod isometry;
mod mesh_solver;
mod normal_equations;
pub(crate) mod normalized_image;
mod photometric;
mod point_data;
mod reprojection;
mod surface_point;
#[cfg(test)]
mod terms_test;

pub use arap::{Arap, PAPER_ARAP_WEIGHT, PAPER_SMOOTHNESS_WEIGHT};
pub use bending::Bending;
pub use depth_prior::{DepthPrior, PointDepth};
pub use energy::{Energy, ResidualSink, Robust};
pub use isometry::Isometry;
pub use mesh_solver::{LengthScale, MeshSolver, Solution, SolveOptions, SolveReport, TermEnergy};
pub use normalized_image::NormalizedImage;
pub use photometric::{Photometric, TexturePoint};
pub use point_data::{PointData, VertexPoint};
pub use reprojection::{ImagePoint, Reprojection};
pub use surface_point::SurfacePoint;
