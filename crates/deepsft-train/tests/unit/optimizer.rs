//! What the optimisers do to one weight.

use burn::module::{Module, Param};
use burn::optim::GradientsParams;
use burn::tensor::{Device, Tensor};
use deepsft_train::{LearningRate, Optimizer};

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
