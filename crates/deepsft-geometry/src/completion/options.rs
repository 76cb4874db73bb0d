//! Weights and limits.

/// Weights and limits of ARAP completion.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CompletionOptions {
    /// Weight of E_arap. Default 20, as in the paper. More keeps the template's shape against noise.
    pub arap_weight: f64,
    /// Weight of E_smooth. Default 0.005, as in the paper.
    pub smoothness_weight: f64,
    /// Iterations at most. Default 9: the paper's "fewer than 10".
    pub max_iterations: usize,
    /// Converged when no vertex moves further than this fraction of the mean edge length. Default 1e-3: a
    /// hundredth of a millimetre on a sheet of paper.
    pub step_tolerance: f64,
}

impl Default for CompletionOptions {
    fn default() -> Self {
        Self {
            arap_weight: 20.0,
            smoothness_weight: 0.005,
            max_iterations: 9,
            step_tolerance: 1e-3,
        }
    }
}
