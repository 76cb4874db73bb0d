//! The mesh solver: a template's vertices that minimise a sum of energies.
//!
//! [`MeshSolver`] is Levenberg-Marquardt in f64 with sparse Cholesky. Its symbolic work is done once a
//! template; terms are small types that implement [`Energy`] and are added by standing in one list:
//!
//! | term | what it holds | residual |
//! |---|---|---|
//! | [`Reprojection`] | registered points at pixels, robust | pixels |
//! | [`PhotoConsistency`] | the template's texture on the image, robust | local deviations of grey |
//! | [`DepthPrior`] | depths with their uncertainty, robust | standard deviations |
//! | [`Isometry`] | edge lengths | lengths / mean edge length |
//! | [`Bending`] | flatness of a thin shell | none (curvature integral) |
//!
//! Nothing depends on the unit of length: a template in metres and one in millimetres give the same
//! shape with the same weights. From 3D points and ARAP alone [`ArapCompletion`](crate::ArapCompletion) completes a mesh.

pub(crate) mod arap_cells;
pub(crate) mod cholesky;
pub(crate) mod energy;
mod mesh_solver;
mod normal_equations;
pub(crate) mod terms;

pub use crate::image::ContrastNormalizedImage;
pub use crate::mesh::SurfacePoint;
pub use energy::{Energy, ResidualSink, Robust, mean_edge_length};
pub use mesh_solver::{MeshSolver, Solution, SolveOptions};
pub(crate) use normal_equations::NormalEquations;
pub(crate) use terms::Rigidity;
pub use terms::{Bending, DepthPrior, ImagePoint, Isometry, PhotoConsistency, PointDepth, Reprojection, TexturePoint};
