//! ARAP completion: the whole mesh from its visible vertices.

mod arap_completion;
mod components;
mod maps_completion;
mod quasi_newton;
mod rotation_extension;
mod stiffness;
mod visible_vertices;

pub use arap_completion::ArapCompletion;
pub use maps_completion::{CompletedMaps, MapsCompletion};
pub use visible_vertices::VisibleVertices;

use crate::solver::{PAPER_ARAP_WEIGHT, PAPER_SMOOTHNESS_WEIGHT};
use glam::DVec3;

/// Weights and limits of ARAP completion.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CompletionOptions {
    /// Weight of E_arap. Default 20, as in the paper. More keeps the template's shape against noise.
    pub arap_weight: f64,
    /// Weight of E_smooth. Default 0.005, as in the paper.
    pub smoothness_weight: f64,
    /// Iterations at most. Default 9: the paper's "fewer than 10".
    pub max_iterations: usize,
    /// Converged when no vertex moves further than this share of the mean edge length. Default 1e-3: a
    /// hundredth of a millimetre on a sheet of paper.
    pub step_tolerance: f64,
}

impl Default for CompletionOptions {
    fn default() -> Self {
        Self {
            arap_weight: PAPER_ARAP_WEIGHT,
            smoothness_weight: PAPER_SMOOTHNESS_WEIGHT,
            max_iterations: 9,
            step_tolerance: 1e-3,
        }
    }
}

/// The terms of the completion's energy, without their weights, in the template's unit of length squared.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct CompletionEnergy {
    /// E_data: sum of w |p_i - x_i|^2 over visible vertices.
    pub data: f64,
    /// E_arap.
    pub arap: f64,
    /// E_smooth.
    pub smoothness: f64,
}

/// How a completion went.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CompletionReport {
    /// Whether the last step was within the tolerance.
    pub converged: bool,
    /// Iterations done.
    pub iterations: usize,
    /// Different vertices with a usable point; the copies of a vertex on a texture seam count once.
    pub visible_vertices: usize,
    /// Points left out because they are not finite.
    pub ignored_points: usize,
    /// Connected components of the mesh.
    pub components: usize,
    /// Components without a visible vertex: placed by the rigid motion of the others, not measured.
    pub unseen_components: usize,
    /// Components with fewer than three visible vertices that are not on one line: their turn is
    /// partly or wholly that of the others (or of the start), not measured.
    pub unoriented_components: usize,
    /// Energies at the rigid alignment.
    pub initial_energy: CompletionEnergy,
    /// Energies of the result.
    pub final_energy: CompletionEnergy,
}

/// A completed mesh.
#[derive(Clone, Debug, PartialEq)]
pub struct Completion {
    /// All vertices, camera frame, in the template's unit.
    pub vertices: Vec<DVec3>,
    /// How it went.
    pub report: CompletionReport,
}
