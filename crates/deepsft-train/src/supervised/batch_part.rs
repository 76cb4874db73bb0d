//! Parts of a batch of step 1, one per device, whose losses sum to the loss of the whole.

use crate::data::{Batch, TrainingBatch};
use crate::device::{part_sizes, weighed};
use crate::error::TrainError;
use crate::loss::{LossWeights, step_one_loss, supervised_maps_loss};
use burn::tensor::{Device, FloatDType, Tensor};
use deepsft_network::Network;

/// A part of a batch of step 1. The losses divide sums over the batch by what counts in it; a part divides by its own,
/// so each of its terms is weighed by the part that is its own.
pub struct BatchPart {
    pub batch: TrainingBatch,
    /// Weights of the terms of [`crate::step_one_loss`].
    pub terms: LossWeights,
    /// Weight of the loss as a whole, for [`weighed`].
    pub weight: f64,
}

impl BatchPart {
    /// `batch` in at most `parts` parts; one is the batch itself with the weights as they are.
    pub fn of(batch: TrainingBatch, parts: usize, terms: &LossWeights) -> Vec<Self> {
        let frames = batch.frames();
        let sizes = part_sizes(frames, parts);
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
                    .map(|part| {
                        let terms = terms_of_part(&part, whole, terms);
                        Self {
                            batch: TrainingBatch::Cells(part),
                            terms,
                            weight: 1.0,
                        }
                    })
                    .collect()
            }
            TrainingBatch::Maps(batch) => {
                let parts = batch.split(&sizes).into_iter().zip(&sizes);
                parts
                    .map(|(part, &size)| Self {
                        batch: TrainingBatch::Maps(part),
                        terms: *terms,
                        weight: size as f64 / frames as f64,
                    })
                    .collect()
            }
        }
    }

    /// What is minimised, [1], of a part of a batch: ours for the compact network, the paper's for those that say
    /// full-resolution maps. The network sees the images in `dtype`, the loss is in single precision.
    pub fn loss(self, network: &Network, device: &Device, dtype: FloatDType) -> Result<Tensor<1>, TrainError> {
        let Self { batch, terms, weight } = self;
        let loss = match batch {
            TrainingBatch::Cells(batch) => {
                let compact = network.as_compact().ok_or_else(|| TrainError::Architecture {
                    actual: network.config().architecture.name(),
                    expected: "compact",
                })?;
                let tensors = batch.into_tensors(device);
                let output = compact.forward_windows(tensors.images.clone().cast(dtype), &tensors.corners);
                step_one_loss(output, &tensors, &terms)
            }
            TrainingBatch::Maps(batch) => {
                let tensors = batch.into_tensors(device);
                let maps = network.forward_maps(tensors.images.cast(dtype));
                supervised_maps_loss(&maps, &tensors.depth, &tensors.registration)
            }
        };
        Ok(weighed(loss, weight))
    }
}

/// `terms` for `part` of a batch whose divisors are `whole`.
fn terms_of_part(part: &Batch, whole: [f64; 3], terms: &LossWeights) -> LossWeights {
    let own = part.loss_divisors();
    let [cells, bins, pixels] = [0, 1, 2].map(|k| own[k] / whole[k]);
    LossWeights {
        refined: terms.refined * cells,
        main: terms.main * cells,
        bins: terms.bins * bins,
        mask: terms.mask * pixels,
        beta: terms.beta,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::data::{BatchShape, MapBatch, Targets};
    use deepsft::{Architecture, NetworkConfig, R50FConfig};
    use deepsft_geometry::{Picture, Template, training_camera};
    use deepsft_synth::{Sample, SynthConfig, Synthesizer};

    const SIZE_MM: [f64; 2] = [180.0, 120.0];

    fn samples(count: u64) -> Vec<Sample> {
        let texture = Picture::from_fn(90, 60, |x, y| [(x * 7 % 256) as u8, (y * 11 % 256) as u8, 90]);
        let template = Template::thin_shell(texture, SIZE_MM[0], SIZE_MM[1]).unwrap();
        let synthesizer = Synthesizer::new(&template, SynthConfig::default()).unwrap();
        (0..count).map(|index| synthesizer.sample(3, index)).collect()
    }

    /// The losses of all parts of `make()`, for 1, 2 and 3 devices, as they count in the whole and as they are.
    fn check(network: &Network, make: impl Fn() -> TrainingBatch) {
        let device = Device::flex();
        let terms = LossWeights::default();
        let loss = |part: BatchPart| -> f64 {
            let loss = part.loss(network, &device, FloatDType::F32).unwrap();
            f64::from(loss.into_scalar::<f32>())
        };
        let whole: Vec<f64> = BatchPart::of(make(), 1, &terms).into_iter().map(loss).collect();
        assert_eq!(whole.len(), 1);
        for devices in [2, 3] {
            let parts = BatchPart::of(make(), devices, &terms);
            assert_eq!(parts.len(), devices);
            let sum: f64 = parts.into_iter().map(loss).sum();
            assert!((sum / whole[0] - 1.0).abs() < 1e-5, "{devices}: {sum} and {}", whole[0]);
            // The parts' own losses differ from it: it matters what they count.
            let as_it_is = |part: BatchPart| BatchPart {
                terms,
                weight: 1.0,
                ..part
            };
            let parts = BatchPart::of(make(), devices, &terms);
            let mean = parts.into_iter().map(|part| loss(as_it_is(part))).sum::<f64>() / devices as f64;
            assert!(
                (mean / whole[0] - 1.0).abs() > 1e-4,
                "{devices}: {mean} and {}",
                whole[0]
            );
        }
    }

    #[test]
    fn the_losses_of_the_parts_sum_to_that_of_the_batch() {
        let (samples, device) = (samples(5), Device::flex());
        let config = NetworkConfig::compact(SIZE_MM, &training_camera());
        let Targets::Cells(targets) = Targets::of(&config) else {
            panic!()
        };
        check(&Network::new(&config, &device), || {
            let shape = BatchShape {
                frames: samples.len(),
                width: 128,
                height: 96,
            };
            let mut batch = Batch::new(shape, targets);
            samples.iter().for_each(|sample| batch.push(sample, 180, 90));
            TrainingBatch::Cells(batch)
        });
        // Folded: what batch normalisation does to a part is not what it does to the whole.
        let config = NetworkConfig::new(Architecture::R50F(R50FConfig::narrow(32)), SIZE_MM, &training_camera());
        check(&Network::new(&config, &device).fold(), || {
            let mut batch = MapBatch::new(samples.len(), config.depth_range);
            samples.iter().for_each(|sample| batch.push(sample));
            TrainingBatch::Maps(batch)
        });
    }
}
