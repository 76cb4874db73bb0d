//! Parts of a batch of steps 2 and 3, one per device, whose losses sum to the loss of the whole.

use super::training_frame::TrainingFrame;
use crate::device::{part_sizes, weighed};
use crate::loss::Reduction;
use burn::tensor::Tensor;

/// A part of a batch of steps 2 and 3.
pub struct FramePart<'a> {
    pub frames: Vec<&'a TrainingFrame>,
    /// Weight of its loss.
    weight: f64,
}

impl<'a> FramePart<'a> {
    /// Its loss as it counts in the whole.
    pub fn weighed(&self, loss: Tensor<1>) -> Tensor<1> {
        weighed(loss, self.weight)
    }

    /// `frames` in at most `parts` parts. `counted`: the number of a frame's pixels that the loss counts.
    pub fn of(
        frames: &[&'a TrainingFrame],
        parts: usize,
        reduction: Reduction,
        counted: impl Fn(&TrainingFrame) -> usize,
    ) -> Vec<Self> {
        let sizes = part_sizes(frames.len(), parts);
        let divisor = |frames: &[&TrainingFrame]| match reduction {
            Reduction::Sum => 1.0,
            Reduction::Mean => frames.iter().map(|frame| counted(frame)).sum::<usize>().max(1) as f64,
        };
        let mut rest = frames;
        let mut all = Vec::new();
        for &size in &sizes {
            let (part, after) = rest.split_at(size);
            rest = after;
            all.push(Self {
                frames: part.to_vec(),
                weight: if sizes.len() > 1 {
                    divisor(part) / divisor(frames)
                } else {
                    1.0
                },
            });
        }
        all
    }
}
