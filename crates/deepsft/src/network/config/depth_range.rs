//! The depths that a network can tell, and how they are normalised.

use serde::{Deserialize, Serialize};

/// Depths the network can say, mm.
///
/// Two measures of depth are used. *Normalised log depth* d = ln(z / near) / ln(far / near) is what the compact
/// network classifies. *Normalised depth* (z - near) / (far - near) is what [`crate::NetworkMaps`] hold and what the
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
    /// Normalised log depth of `depth_mm`.
    pub fn normalise(&self, depth_mm: f64) -> f64 {
        (depth_mm / self.near_mm).ln() / (self.far_mm / self.near_mm).ln()
    }

    /// Depth in mm of normalised log depth `d`.
    pub fn depth_mm(&self, d: f64) -> f64 {
        self.near_mm * (self.far_mm / self.near_mm).powf(d)
    }

    /// Millimetres in one unit of normalised depth.
    pub fn span_mm(&self) -> f64 {
        self.far_mm - self.near_mm
    }

    /// Normalised depth of `depth_mm`.
    pub fn normalise_linear(&self, depth_mm: f64) -> f64 {
        (depth_mm - self.near_mm) / self.span_mm()
    }

    /// Depth in mm of normalised depth `depth`.
    pub fn depth_mm_linear(&self, depth: f64) -> f64 {
        self.near_mm + depth * self.span_mm()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn both_measures_of_depth_come_back_and_end_at_the_ends_of_the_range() {
        let range = DepthRange::default();
        for z in [150.0, 333.0, 1200.0] {
            assert!((range.depth_mm(range.normalise(z)) - z).abs() < 1e-9);
            assert!((range.depth_mm_linear(range.normalise_linear(z)) - z).abs() < 1e-9);
        }
        assert_eq!(
            (range.normalise_linear(150.0), range.normalise_linear(1200.0)),
            (0.0, 1.0)
        );
    }
}
