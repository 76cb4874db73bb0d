//! Optimisers by name, with the values that the paper or we chose.

use burn::grad_clipping::GradientClippingConfig;
use burn::optim::momentum::MomentumConfig;
use burn::optim::{AdamConfig, AdamWConfig, ModuleOptimizer, SgdConfig};
use serde::Serialize;

/// Keras' epsilon, with which the paper's Adam divides.
const KERAS_EPSILON: f32 = 1e-7;

/// An optimiser.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[non_exhaustive]
pub enum Optimizer {
    /// Adam without weight decay or clipping. The paper's step 1 has both betas at 0.9.
    Adam {
        /// Decay rates of the moments.
        betas: [f32; 2],
    },
    /// Adam with decoupled weight decay and clipped gradients. Ours.
    AdamW {
        /// Decay of the weights per iteration, relative to the learning rate.
        weight_decay: f32,
        /// Largest norm of a weight's gradient.
        clip: f32,
    },
    /// Stochastic gradient descent. The paper's steps 2 and 3; it gives no momentum for step 2 and no value for step 3,
    /// where ours is Keras' usual 0.9.
    Sgd {
        /// Momentum; 0 for none.
        momentum: f64,
    },
}

impl Optimizer {
    /// Makes the optimiser in its first state.
    pub fn init(&self) -> ModuleOptimizer {
        match *self {
            Self::Adam { betas: [first, second] } => AdamConfig::new()
                .with_beta_1(first)
                .with_beta_2(second)
                .with_epsilon(KERAS_EPSILON)
                .init(),
            Self::AdamW { weight_decay, clip } => AdamWConfig::new()
                .with_weight_decay(weight_decay)
                .with_epsilon(1e-8)
                .with_grad_clipping(Some(GradientClippingConfig::Norm(clip)))
                .init(),
            Self::Sgd { momentum: 0.0 } => SgdConfig::new().init(),
            // Without dampening, as Keras: v = momentum v + gradient.
            Self::Sgd { momentum } => SgdConfig::new()
                .with_momentum(Some(MomentumConfig::new().with_momentum(momentum).with_dampening(0.0)))
                .init(),
        }
    }
}

/// A learning rate that falls with the iterations as Keras' `decay` has it: rate / (1 + decay iteration).
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct LearningRate {
    /// At the first iteration.
    pub initial: f64,
    /// Decay per iteration.
    pub decay: f64,
}

impl LearningRate {
    /// The rate of iteration `iteration`.
    pub fn at(&self, iteration: u64) -> f64 {
        self.initial / (1.0 + self.decay * iteration as f64)
    }
}
