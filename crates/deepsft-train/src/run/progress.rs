//! What a training reports while it runs.

use crate::device::LossScale;
use crate::run::checkpoint::CurvePoint;

/// What a training tells while it runs.
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
    /// A step was made.
    Step {
        /// Share of the budget spent, 0..=1.
        share: f64,
        /// Samples seen.
        samples: u64,
        /// Seconds trained.
        seconds: f64,
        /// Loss of the step.
        loss: f64,
    },
    /// A step in half precision was not made: its gradients were not finite.
    Skipped {
        /// Samples seen.
        samples: u64,
        /// The scale after it, and the number of such steps.
        scale: LossScale,
    },
    /// The held-out set was evaluated and a checkpoint saved.
    Evaluated(CurvePoint),
}
