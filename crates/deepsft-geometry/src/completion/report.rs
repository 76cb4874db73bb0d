//! What a completion gives.

use glam::DVec3;

/// The terms of the completion's energy, without their weights, in the template's unit of length squared.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct CompletionEnergy {
    /// E_data: sum of w |p_i - x_i|^2 over visible vertices.
    pub data: f64,
    /// E_arap.
    pub arap: f64,
    /// E_smooth.
    pub smoothness: f64,
}

/// A completed mesh, and how its completion went.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Completion {
    /// All vertices, camera frame, in the template's unit.
    pub vertices: Vec<DVec3>,
    /// Whether the last step was within the tolerance.
    pub converged: bool,
    /// Iterations done.
    pub iterations: usize,
    /// Energies at the rigid alignment.
    pub initial_energy: CompletionEnergy,
    /// Energies of the result.
    pub final_energy: CompletionEnergy,
}
