//! How the learning rate and the windows change while training proceeds.

use crate::data::BatchShape;
use serde::Serialize;

/// A learning-rate schedule with progressive windows. Training sees first windows of the frame, many per second, then whole
/// frames; the learning rate warms up and then falls along a cosine.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Schedule {
    /// Largest learning rate.
    pub peak: f64,
    /// Learning rate at the end, as a fraction of the peak.
    pub end_fraction: f64,
    /// Iterations of linear warm-up.
    pub warm_up: u64,
    /// Fraction of the budget spent on windows.
    pub window_fraction: f64,
    /// Batches while training on windows.
    pub windows: BatchShape,
    /// Batches while training on whole frames.
    pub frames: BatchShape,
}

impl Default for Schedule {
    fn default() -> Self {
        Self {
            peak: 2e-3,
            end_fraction: 0.02,
            warm_up: 100,
            window_fraction: 0.6,
            windows: BatchShape {
                frames: 16,
                width: 256,
                height: 160,
            },
            frames: BatchShape::whole_frames(8),
        }
    }
}

impl Schedule {
    /// Whole frames at one rate: batches of `frames`.
    pub fn constant(rate: f64, frames: usize) -> Self {
        let frames = BatchShape::whole_frames(frames);
        Self {
            peak: rate,
            end_fraction: 1.0,
            warm_up: 1,
            window_fraction: 0.0,
            windows: frames,
            frames,
        }
    }

    /// Learning rate of iteration `iteration` when the fraction `progress` (0..=1) of the budget is spent.
    pub fn learning_rate(&self, iteration: u64, progress: f64) -> f64 {
        let warm = ((iteration + 1) as f64 / self.warm_up.max(1) as f64).min(1.0);
        let cosine = (1.0 + (std::f64::consts::PI * progress.clamp(0.0, 1.0)).cos()) / 2.0;
        self.peak * warm * (self.end_fraction + (1.0 - self.end_fraction) * cosine)
    }

    /// Shape of the batches at `progress`.
    pub fn shape(&self, progress: f64) -> BatchShape {
        if progress < self.window_fraction {
            self.windows
        } else {
            self.frames
        }
    }
}
