//! How the weights of a new layer begin.

use burn::tensor::{Device, Distribution, Tensor};

/// How the weights of a new layer are made.
#[derive(Clone, Copy, Debug)]
pub struct WeightInit<'a> {
    /// Where they lie.
    pub device: &'a Device,
    /// Drawn for training with batch normalisation after the convolutions; or zero and folded, to be loaded.
    pub drawn: bool,
    /// Weight of a batch's statistics in the running ones.
    pub momentum: f64,
}

impl<'a> WeightInit<'a> {
    /// Weights drawn for training.
    pub fn drawn(device: &'a Device, momentum: f64) -> Self {
        Self {
            device,
            drawn: true,
            momentum,
        }
    }

    /// Weights of a folded network, still to be loaded.
    pub fn empty(device: &'a Device, momentum: f64) -> Self {
        Self {
            device,
            drawn: false,
            momentum,
        }
    }

    /// Weights of any shape by Glorot and Bengio (2010): uniform within sqrt(6 / (fan-in + fan-out)).
    pub fn glorot<const D: usize>(&self, shape: [usize; D], fan_in: usize, fan_out: usize) -> Tensor<D> {
        if !self.drawn {
            return Tensor::zeros(shape, self.device);
        }
        let limit = (6.0 / (fan_in + fan_out) as f64).sqrt();
        Tensor::random(shape, Distribution::Uniform(-limit, limit), self.device)
    }
}
