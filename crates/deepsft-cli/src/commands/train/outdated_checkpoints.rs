//! Checkpoints of steps 2 and 3 whose starting network is gone, because the step before them has trained on.

use super::plan::Plan;
use anyhow::Result;
use deepsft_train::{Progress, RefinementStep, set_aside_checkpoint};
use std::path::PathBuf;

/// The checkpoints of the steps after one that runs.
pub struct LaterCheckpoints {
    /// Number of the step that runs.
    number: u8,
    later: Vec<(u8, PathBuf)>,
    /// Whether they have been set aside, and whether that went well.
    outcome: Option<Result<()>>,
}

impl LaterCheckpoints {
    /// Those after the step of a number, whether they are part of this training or not: they are beside the same
    /// bundle.
    pub fn after(number: u8, plan: &Plan<'_>) -> Self {
        let steps = [RefinementStep::Depth, RefinementStep::Registration].into_iter();
        Self {
            number,
            later: steps
                .filter(|step| step.number() > number)
                .map(|step| (step.number(), plan.checkpoint(step)))
                .collect(),
            outcome: None,
        }
    }

    /// Hears what the running step tells. As soon as it trains, not only when it ends: a training that is killed in
    /// between would find them later, and not know that they are outdated.
    pub fn hear(&mut self, told: &Progress, say: impl FnMut(String)) {
        if self.outcome.is_none() && matches!(told, Progress::Step { .. }) {
            self.outcome = Some(self.set_aside(say));
        }
    }

    fn set_aside(&self, mut say: impl FnMut(String)) -> Result<()> {
        for (later, checkpoint) in &self.later {
            if let Some(kept) = set_aside_checkpoint(checkpoint)? {
                say(format!(
                    "step {later} begins anew: it had started from the network before step {} went on; its checkpoint is kept as {}",
                    self.number,
                    kept.display()
                ));
            }
        }
        Ok(())
    }

    /// What went wrong, when the step has ended.
    pub fn end(self) -> Result<()> {
        self.outcome.unwrap_or(Ok(()))
    }
}
