//! What a training reports while it runs.

use super::checkpoint::CurvePoint;

/// A report of a training that runs.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub enum Progress {
    /// A checkpoint was found and is continued.
    Resumed {
        /// Samples it had seen.
        samples: u64,
        /// Seconds it had trained.
        seconds: f64,
    },
    /// The weights were updated.
    Step {
        /// Fraction of the budget spent, 0..=1.
        fraction: f64,
        /// Samples seen.
        samples: u64,
        /// Seconds trained.
        seconds: f64,
        /// Loss of the batch.
        loss: f64,
    },
    /// The held-out frames were measured; apart from the first time a checkpoint was saved.
    Evaluated(CurvePoint),
}
