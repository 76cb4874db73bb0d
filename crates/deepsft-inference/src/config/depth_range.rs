//! The range of depths that a network can tell, and how they are normalised.

use serde::{Deserialize, Serialize};

/// The range of depths that a network can tell, mm.
///
/// Two measures of depth are used. *Normalised log depth* d = ln(z / near) / ln(far / near) is what the compact
/// network classifies. *Normalised depth* (z - near) / (far - near) is what the maps of a network in training hold and what the
/// paper's network and R50F are trained to say (the paper gives no unit; our choice): an error of a millimetre
/// weighs the same at every distance, as in the paper's loss, and depth is of the size of the registration beside it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct DepthRange {
    /// Depth of d = 0, mm.
    pub near_mm: f64,
    /// Depth of d = 1, mm.
    pub far_mm: f64,
}

impl Default for DepthRange {
    fn default() -> Self {
        Self {
            near_mm: 150.0,
            far_mm: 1200.0,
        }
    }
}

impl DepthRange {
    /// Returns the normalised log depth of `depth_mm`.
    pub fn normalise(&self, depth_mm: f64) -> f64 {
        (depth_mm / self.near_mm).ln() / (self.far_mm / self.near_mm).ln()
    }

    /// Returns the depth in mm of normalised log depth `d`.
    pub fn depth_mm(&self, d: f64) -> f64 {
        self.near_mm * (self.far_mm / self.near_mm).powf(d)
    }

    /// Returns the millimetres in one unit of normalised depth.
    pub fn span_mm(&self) -> f64 {
        self.far_mm - self.near_mm
    }

    /// Returns the normalised depth of `depth_mm`.
    pub fn normalise_linear(&self, depth_mm: f64) -> f64 {
        (depth_mm - self.near_mm) / self.span_mm()
    }

    /// Returns the depth in mm of normalised depth `depth`.
    pub fn depth_mm_linear(&self, depth: f64) -> f64 {
        self.near_mm + depth * self.span_mm()
    }
}
