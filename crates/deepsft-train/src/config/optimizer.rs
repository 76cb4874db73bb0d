//! Optimisers by name, with the values that the paper or we chose.

use burn::grad_clipping::GradientClippingConfig;
use burn::optim::momentum::MomentumConfig;
use burn::optim::{AdamConfig, AdamWConfig, ModuleOptimizer, SgdConfig};
use serde::Serialize;

/// Keras' epsilon, with which the paper's Adam divides.
const KERAS_EPSILON: f32 = 1e-7;

/// An optimiser.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
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
    /// The optimiser in its first state.
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

#[cfg(test)]
mod tests {
    use super::*;
    use burn::module::{Module, Param};
    use burn::optim::GradientsParams;
    use burn::tensor::{Device, Tensor};

    #[derive(Module, Debug)]
    struct Weight {
        value: Param<Tensor<1>>,
    }

    /// A weight of 1 after `steps` steps of rate 0.1 down the slope 2.
    fn descended(optimizer: Optimizer, steps: usize) -> f32 {
        let device = Device::flex().autodiff();
        let mut weight = Weight {
            value: Param::from_tensor(Tensor::from_floats([1.0], &device)),
        };
        let mut optimizer = optimizer.init();
        for _ in 0..steps {
            let gradients = GradientsParams::from_grads((weight.value.val() * 2.0).sum().backward(), &weight);
            weight = optimizer.step(0.1, weight, gradients);
        }
        weight.value.val().into_scalar::<f32>()
    }

    #[test]
    fn sgd_goes_down_the_gradient_and_momentum_adds_up() {
        assert!((descended(Optimizer::Sgd { momentum: 0.0 }, 3) - 0.4).abs() < 1e-6);
        // v: 2, 3.8, 5.42; their sum is 11.22.
        assert!((descended(Optimizer::Sgd { momentum: 0.9 }, 3) - (1.0 - 1.122)).abs() < 1e-5);
    }

    #[test]
    fn adam_steps_by_the_rate_whatever_the_gradient() {
        assert!((descended(Optimizer::Adam { betas: [0.9, 0.9] }, 3) - 0.7).abs() < 1e-4);
    }

    #[test]
    fn the_rate_decays_as_in_keras() {
        let rate = LearningRate {
            initial: 1e-2,
            decay: 0.5,
        };
        assert!((rate.at(0) - 1e-2).abs() < 1e-12 && (rate.at(6) - 2.5e-3).abs() < 1e-12);
    }
}
