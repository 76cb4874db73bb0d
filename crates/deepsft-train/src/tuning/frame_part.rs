//! Parts of a batch of steps 2 and 3, one per device, whose losses sum to the loss of the whole.

use super::training_frame::TrainingFrame;
use crate::device::{part_sizes, weighed};
use crate::loss::Reduction;
use burn::tensor::Tensor;

/// A share of a batch of steps 2 and 3.
pub struct FrameShare<'a> {
    pub frames: Vec<&'a TrainingFrame>,
    /// Weight of its loss.
    weight: f64,
}

impl<'a> FrameShare<'a> {
    /// Its loss as it counts in the whole.
    pub fn weighed(&self, loss: Tensor<1>) -> Tensor<1> {
        weighed(loss, self.weight)
    }

    /// `frames` in at most `parts` shares. `counts`: the pixels of a frame that the loss's sums are divided by, as
    /// `reduction` says.
    pub fn of(
        frames: &[&'a TrainingFrame],
        parts: usize,
        reduction: Reduction,
        counts: impl Fn(&TrainingFrame) -> &[bool],
    ) -> Vec<Self> {
        let sizes = part_sizes(frames.len(), parts);
        let divisor = |frames: &[&TrainingFrame]| {
            let counted = |frame: &&TrainingFrame| counts(frame).iter().filter(|&&counts| counts).count();
            frames.iter().map(counted).sum::<usize>().max(1) as f64
        };
        let weight = |share: &[&TrainingFrame]| match reduction {
            Reduction::Mean if sizes.len() > 1 => divisor(share) / divisor(frames),
            _ => 1.0,
        };
        let mut rest = frames;
        let mut shares = Vec::new();
        for &size in &sizes {
            let (share, after) = rest.split_at(size);
            rest = after;
            shares.push(Self {
                frames: share.to_vec(),
                weight: weight(share),
            });
        }
        shares
    }
}
