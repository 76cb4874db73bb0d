//! Shares of a batch, one a device, whose losses sum to the loss of the whole.

use crate::batch::Batch;
use crate::loader::TrainingBatch;
use crate::loss::{LossWeights, Reduction};
use crate::recorded_frames::TrainingFrame;
use burn::tensor::Tensor;

/// Sizes of at most `parts` shares of `count` things: as even as can be, the larger ones first, none empty.
pub fn share_sizes(count: usize, parts: usize) -> Vec<usize> {
    let parts = parts.clamp(1, count.max(1));
    (0..parts)
        .map(|part| count / parts + usize::from(part < count % parts))
        .collect()
}

/// A share of a batch of step 1. The losses divide sums over the batch by what counts in it; a share divides by its own,
/// so each of its terms is weighed by the part that is its own.
pub struct BatchShare {
    pub batch: TrainingBatch,
    /// Weights of the terms of [`crate::step_one_loss`].
    pub terms: LossWeights,
    /// Weight of the loss as a whole, for [`weighed`].
    pub weight: f64,
}

/// `loss` times `weight`: untouched where that is 1.
pub fn weighed(loss: Tensor<1>, weight: f64) -> Tensor<1> {
    if weight == 1.0 { loss } else { loss * weight }
}

impl BatchShare {
    /// `batch` in at most `parts` shares; one is the batch itself with the weights as they are.
    pub fn of(batch: TrainingBatch, parts: usize, terms: &LossWeights) -> Vec<Self> {
        let frames = batch.frames();
        let sizes = share_sizes(frames, parts);
        if sizes.len() == 1 {
            return vec![Self {
                batch,
                terms: *terms,
                weight: 1.0,
            }];
        }
        match batch {
            TrainingBatch::Cells(batch) => {
                let whole = batch.loss_divisors();
                batch
                    .split(&sizes)
                    .into_iter()
                    .map(|share| {
                        let terms = terms_of_share(&share, whole, terms);
                        Self {
                            batch: TrainingBatch::Cells(share),
                            terms,
                            weight: 1.0,
                        }
                    })
                    .collect()
            }
            TrainingBatch::Maps(batch) => {
                let shares = batch.split(&sizes).into_iter().zip(&sizes);
                shares
                    .map(|(share, &size)| Self {
                        batch: TrainingBatch::Maps(share),
                        terms: *terms,
                        weight: size as f64 / frames as f64,
                    })
                    .collect()
            }
        }
    }
}

/// `terms` for `share` of a batch whose divisors are `whole`.
fn terms_of_share(share: &Batch, whole: [f64; 3], terms: &LossWeights) -> LossWeights {
    let own = share.loss_divisors();
    let [cells, bins, pixels] = [0, 1, 2].map(|k| own[k] / whole[k]);
    LossWeights {
        refined: terms.refined * cells,
        main: terms.main * cells,
        bins: terms.bins * bins,
        mask: terms.mask * pixels,
        beta: terms.beta,
    }
}

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
        let sizes = share_sizes(frames.len(), parts);
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::batch::{BatchShape, TargetShape};
    use crate::map_batch::MapBatch;
    use crate::trainer::share_loss;
    use burn::tensor::{Device, FloatDType};
    use deepsft::{Architecture, Network, NetworkConfig, R50FConfig};
    use deepsft_geometry::{Picture, Template, training_camera};
    use deepsft_synth::{Sample, SynthConfig, Synthesizer};

    #[test]
    fn shares_are_as_even_as_can_be_and_never_empty() {
        assert_eq!(share_sizes(7, 2), [4, 3]);
        assert_eq!(share_sizes(6, 3), [2, 2, 2]);
        assert_eq!(share_sizes(2, 3), [1, 1]);
        assert_eq!(share_sizes(5, 1), [5]);
        assert_eq!(share_sizes(0, 4), [0]);
    }

    const SIZE_MM: [f64; 2] = [180.0, 120.0];

    fn samples(count: u64) -> Vec<Sample> {
        let texture = Picture::from_fn(90, 60, |x, y| [(x * 7 % 256) as u8, (y * 11 % 256) as u8, 90]);
        let template = Template::thin_shell(texture, SIZE_MM[0], SIZE_MM[1]).unwrap();
        let synthesizer = Synthesizer::new(&template, SynthConfig::default()).unwrap();
        (0..count).map(|index| synthesizer.sample(3, index)).collect()
    }

    /// The losses of all shares of `make()`, for 1, 2 and 3 devices, as they count in the whole and as they are.
    fn check(network: &Network, make: impl Fn() -> TrainingBatch) {
        let device = Device::flex();
        let terms = LossWeights::default();
        let loss = |share: BatchShare| -> f64 {
            let loss = share_loss(network, share, &device, FloatDType::F32).unwrap();
            f64::from(loss.into_scalar::<f32>())
        };
        let whole: Vec<f64> = BatchShare::of(make(), 1, &terms).into_iter().map(loss).collect();
        assert_eq!(whole.len(), 1);
        for parts in [2, 3] {
            let shares = BatchShare::of(make(), parts, &terms);
            assert_eq!(shares.len(), parts);
            let sum: f64 = shares.into_iter().map(loss).sum();
            assert!((sum / whole[0] - 1.0).abs() < 1e-5, "{parts}: {sum} and {}", whole[0]);
            // The shares' own losses differ from it: it matters what they count.
            let as_it_is = |share: BatchShare| BatchShare {
                terms,
                weight: 1.0,
                ..share
            };
            let shares = BatchShare::of(make(), parts, &terms);
            let mean = shares.into_iter().map(|share| loss(as_it_is(share))).sum::<f64>() / parts as f64;
            assert!((mean / whole[0] - 1.0).abs() > 1e-4, "{parts}: {mean} and {}", whole[0]);
        }
    }

    #[test]
    fn the_losses_of_the_shares_sum_to_that_of_the_batch() {
        let (samples, device) = (samples(5), Device::flex());
        let config = NetworkConfig::compact(SIZE_MM, &training_camera());
        let targets = TargetShape::of(&config).unwrap();
        check(&config.init(&device), || {
            let shape = BatchShape {
                frames: samples.len(),
                width: 128,
                height: 96,
            };
            let mut batch = Batch::new(shape, targets);
            samples.iter().for_each(|sample| batch.push(sample, 180, 90));
            TrainingBatch::Cells(batch)
        });
        // Folded: what batch normalisation does to a share is not what it does to the whole.
        let config = NetworkConfig::new(Architecture::R50F(R50FConfig::narrow(32)), SIZE_MM, &training_camera());
        check(&config.init(&device).fold(), || {
            let mut batch = MapBatch::new(samples.len(), config.depth_range);
            samples.iter().for_each(|sample| batch.push(sample));
            TrainingBatch::Maps(batch)
        });
    }
}
