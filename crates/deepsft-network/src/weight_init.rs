//! How the weights of a new layer begin.

use burn::tensor::{Device, Distribution, Tensor};

/// How the weights of a new layer are made.
#[derive(Clone, Copy, Debug)]
pub struct WeightInit<'a> {
    /// Where they lie.
    pub device: &'a Device,
    /// Drawn for training, with what is folded in the end; or zero and folded, to be loaded.
    pub drawn: bool,
    /// Weight of a batch's statistics in the running ones.
    pub momentum: f64,
}

impl<'a> WeightInit<'a> {
    /// Weights that are `drawn`, or zero.
    pub fn new(device: &'a Device, drawn: bool, momentum: f64) -> Self {
        Self {
            device,
            drawn,
            momentum,
        }
    }

    /// Weights of any shape by Glorot and Bengio (2010): uniform within sqrt(6 / (fan-in + fan-out)).
    pub fn glorot<const D: usize>(&self, shape: [usize; D], fan_in: usize, fan_out: usize) -> Tensor<D> {
        let limit = (6.0 / (fan_in + fan_out) as f64).sqrt();
        self.random(shape, Distribution::Uniform(-limit, limit))
    }

    /// Weights of any shape of a normal distribution.
    pub fn normal<const D: usize>(&self, shape: [usize; D], deviation: f64) -> Tensor<D> {
        self.random(shape, Distribution::Normal(0.0, deviation))
    }

    fn random<const D: usize>(&self, shape: [usize; D], distribution: Distribution) -> Tensor<D> {
        match self.drawn {
            true => Tensor::random(shape, distribution, self.device),
            false => Tensor::zeros(shape, self.device),
        }
    }
}
