//! An update of the weights: loss and gradients of a batch, on one device or several, and the optimiser's step.

use super::precision::{LossScale, Precision, unscaled};
use super::replica::{RunningStatistics, replica};
use crate::error::TrainError;
use burn::module::Module;
use burn::optim::{GradientsAccumulator, GradientsParams, ModuleOptimizer};
use burn::tensor::{Device, FloatDType, Tensor};
use deepsft_network::Network;
use std::panic::resume_unwind;
use std::thread;

/// Updates the weights in a training.
///
/// Several devices are used as burn's own trainer does with a main device (`MultiDeviceOptim::OptimMainDevice`): the
/// network is copied to each, each works out loss and gradients of its part of the batch in a thread of its own, the
/// gradients are brought to the first device and summed there in the order of the parts, and one optimiser steps there.
/// burn's other way, an all-reduce, exists under CUDA alone.
pub struct Stepper {
    /// Differentiable; the first holds the network and the optimiser's state.
    devices: Vec<Device>,
    /// The first device without differentiation, where gradients are summed.
    plain: Device,
    scale: LossScale,
}

/// An update of the weights.
pub struct Step {
    /// The network after it.
    pub network: Network,
    /// Loss of the batch before it.
    pub loss: f64,
    /// Whether it was made: a step in half precision whose gradients are not finite is not.
    pub made: bool,
}

/// What a device works out of its part.
struct PartGradients {
    loss: f64,
    /// `None` when the loss is not finite.
    gradients: Option<GradientsParams>,
}

impl Stepper {
    /// For the plain `first` device, which holds the network, and `more` beside it.
    ///
    /// # Errors
    /// [`TrainError::Precision`] when a device does not compute in `precision`.
    pub fn new(first: &Device, more: &[Device], precision: Precision) -> Result<Self, TrainError> {
        let all = || std::iter::once(first).chain(more);
        all().try_for_each(|device| precision.check(device))?;
        Ok(Self {
            devices: all().map(|device| device.clone().autodiff()).collect(),
            plain: first.clone(),
            scale: LossScale::new(precision),
        })
    }

    /// The devices, differentiable.
    pub fn devices(&self) -> &[Device] {
        &self.devices
    }

    /// What images are cast to.
    pub fn dtype(&self) -> FloatDType {
        self.scale.precision.dtype()
    }

    /// The loss scale for a checkpoint; `None` in single precision, where there is none.
    pub fn scale(&self) -> Option<LossScale> {
        (self.scale.precision != Precision::F32).then_some(self.scale)
    }

    /// Goes on with the scale of a checkpoint, if it is one of this precision.
    pub fn resume(&mut self, saved: Option<LossScale>) {
        self.scale = saved
            .filter(|saved| saved.precision == self.scale.precision)
            .unwrap_or(self.scale);
    }

    /// A step of `network` with learning rate `rate` on the `parts` of a batch, at most one per device. `loss` is that of
    /// a part, [1], by a copy of the network on the device of that number; the losses of the parts sum to that of
    /// the batch.
    ///
    /// # Errors
    /// Those of `loss`; [`TrainError::Diverged`], which names `samples`, when the loss is not finite (in half precision:
    /// when loss or gradients are not, and no smaller scale is left to try).
    pub fn step<Part: Send>(
        &mut self,
        network: Network,
        optimizer: &mut ModuleOptimizer,
        rate: f64,
        parts: Vec<Part>,
        samples: u64,
        loss: impl Fn(&Network, Part, usize) -> Result<Tensor<1>, TrainError> + Sync,
    ) -> Result<Step, TrainError> {
        // One device in single precision trains the network itself. All others train copies, whose running statistics
        // are kept only if the step is made.
        let (results, statistics) = if parts.len() == 1 && self.scale.precision == Precision::F32 {
            let results = parts.into_iter().map(|part| self.gradients(&network, part, 0, &loss));
            (results.collect::<Result<Vec<_>, _>>()?, None)
        } else {
            let (results, statistics) = self.gradients_of_copies(&network, parts, &loss)?;
            (results, Some(RunningStatistics::mean(statistics, &self.plain)))
        };
        let value = results.iter().map(|result| result.loss).sum::<f64>();
        let Some(gradients) = self.summed(&network, results) else {
            if !self.scale.step_skipped() {
                return Err(TrainError::Diverged { loss: value, samples });
            }
            return Ok(Step {
                network,
                loss: value,
                made: false,
            });
        };
        let network = optimizer.step(rate, network, gradients);
        let network = match statistics {
            Some(statistics) => statistics.put_into(network),
            None => network,
        };
        self.scale.step_made();
        Ok(Step {
            network,
            loss: value,
            made: true,
        })
    }

    /// Loss and gradients of each part by a copy of the network of its own, and the copies' running statistics.
    fn gradients_of_copies<Part: Send>(
        &self,
        network: &Network,
        parts: Vec<Part>,
        loss: &(impl Fn(&Network, Part, usize) -> Result<Tensor<1>, TrainError> + Sync),
    ) -> Result<(Vec<PartGradients>, Vec<RunningStatistics>), TrainError> {
        let alone = parts.len() == 1;
        let results: Result<Vec<_>, TrainError> = thread::scope(|scope| {
            let numbered = parts.into_iter().zip(&self.devices).enumerate();
            let workers: Vec<_> = numbered
                .map(|(number, (part, device))| {
                    let copy = replica(network, device);
                    let work = move || {
                        let mut result = self.gradients(&copy, part, number, loss)?;
                        result.gradients = result
                            .gradients
                            .map(|gradients| gradients.to_device(&self.plain, &copy));
                        Ok((result, RunningStatistics::of(&copy.valid())))
                    };
                    if alone { Err(work()) } else { Ok(scope.spawn(work)) }
                })
                .collect();
            let joined = workers.into_iter().map(|worker| match worker {
                Ok(worker) => worker.join().unwrap_or_else(|panic| resume_unwind(panic)),
                Err(done) => done,
            });
            joined.collect()
        });
        Ok(results?.into_iter().unzip())
    }

    /// Loss and gradients of a part.
    fn gradients<Part>(
        &self,
        network: &Network,
        part: Part,
        number: usize,
        loss: &impl Fn(&Network, Part, usize) -> Result<Tensor<1>, TrainError>,
    ) -> Result<PartGradients, TrainError> {
        let loss = loss(network, part, number)?;
        let value = f64::from(loss.clone().into_scalar::<f32>());
        let gradients = value.is_finite().then(|| {
            let scale = self.scale.scale;
            let scaled = if scale == 1.0 { loss } else { loss * scale };
            GradientsParams::from_grads(scaled.backward(), network)
        });
        Ok(PartGradients { loss: value, gradients })
    }

    /// The gradients of the whole batch on the first device, the scale taken out; `None` when they are not finite (which
    /// in single precision only the loss tells).
    fn summed(&self, network: &Network, results: Vec<PartGradients>) -> Option<GradientsParams> {
        let gradients: Option<Vec<_>> = results.into_iter().map(|result| result.gradients).collect();
        let mut gradients = gradients?;
        let sum = if gradients.len() == 1 {
            gradients.pop()?
        } else {
            let mut sum = GradientsAccumulator::new();
            gradients
                .into_iter()
                .for_each(|gradients| sum.accumulate(network, gradients));
            sum.grads()
        };
        match self.scale.precision {
            Precision::F32 => Some(sum),
            _ => unscaled(sum, network, self.scale.scale),
        }
    }
}
