//! Gradients through whole networks in training (batch statistics, max pooling, strides, up-sampling, cropping) against
//! central differences, in double precision.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use burn::module::{Module, ModuleMapper, ModuleVisitor, Param};
use burn::tensor::{DType, Device, Distribution, FloatDType, Gradients, Tensor, TensorData};
use deepsft::{Architecture, Network, NetworkConfig, PaperConfig, R50FConfig};
use deepsft_geometry::training_camera;

/// Step along a direction of unit weights: small enough that hardly any ReLU changes its side.
const STEP: f64 = 1e-7;
/// Relative. Rounding of sums of 10^5 terms divided by the step, and the few kinks on the way.
const TOLERANCE: f64 = 1e-4;

struct Double;

impl ModuleMapper for Double {
    fn map_float<const D: usize>(&mut self, param: Param<Tensor<D>>) -> Param<Tensor<D>> {
        param.map(|weights| Tensor::from_inner(weights.inner().cast(FloatDType::F64)).require_grad())
    }
}

/// A value of -1..1 that depends on its place alone.
fn direction(array: usize, count: usize) -> Vec<f64> {
    (0..count)
        .map(|i| ((i * 7919 + array * 104_729) % 2003) as f64 / 1001.0 - 1.0)
        .collect()
}

fn direction_like<const D: usize>(array: usize, weights: &Tensor<D>) -> Tensor<D> {
    let shape = weights.dims();
    let values = direction(array, shape.iter().product());
    Tensor::from_data(TensorData::new(values, shape), (&weights.device(), DType::F64))
}

/// Moves all trained weights along the direction.
struct Move {
    step: f64,
    arrays: usize,
}

impl ModuleMapper for Move {
    fn map_float<const D: usize>(&mut self, param: Param<Tensor<D>>) -> Param<Tensor<D>> {
        if !param.is_require_grad() {
            return param;
        }
        self.arrays += 1;
        let (step, array) = (self.step, self.arrays);
        param.map(|weights| {
            let along = direction_like(array, &weights.clone().inner());
            Tensor::from_inner(weights.inner() + along * step).require_grad()
        })
    }
}

/// The gradient times the direction.
struct Slope<'a> {
    gradients: &'a Gradients,
    arrays: usize,
    sum: f64,
}

impl ModuleVisitor for Slope<'_> {
    fn visit_float<const D: usize>(&mut self, param: &Param<Tensor<D>>) {
        if !param.is_require_grad() {
            return;
        }
        self.arrays += 1;
        let gradient = param.val().grad(self.gradients).unwrap();
        let along = direction_like(self.arrays, &gradient);
        self.sum += (gradient * along).sum().into_scalar::<f64>();
    }
}

fn loss(network: &Network, images: &Tensor<4>) -> Tensor<1> {
    let maps = network.forward_maps(images.clone());
    // Targets that no map meets, another one for each.
    let term = |map: Tensor<4>, target: f64| (map - target).square().mean();
    term(maps.main_depth, 0.5)
        + term(maps.main_registration, 0.25)
        + term(maps.depth, -1.0)
        + term(maps.registration, 1.0)
}

#[test]
fn the_slope_of_a_loss_along_a_direction_of_all_weights_is_what_central_differences_say() {
    let device = Device::flex().autodiff();
    for architecture in [
        Architecture::Paper(PaperConfig::narrow(32)),
        Architecture::R50F(R50FConfig::narrow(32)),
    ] {
        let config = NetworkConfig::new(architecture, [297.0, 210.0], &training_camera());
        let network = config.init(&device).map(&mut Double);
        let images =
            Tensor::<4>::random([2, 3, 270, 480], Distribution::Uniform(0.0, 1.0), &device).cast(FloatDType::F64);
        let gradients = loss(&network, &images).backward();
        let mut slope = Slope {
            gradients: &gradients,
            arrays: 0,
            sum: 0.0,
        };
        network.visit(&mut slope);
        assert!(slope.arrays > 100, "{} arrays", slope.arrays);
        let moved = |step: f64| {
            let network = network.clone().map(&mut Move { step, arrays: 0 });
            loss(&network, &images).into_scalar::<f64>()
        };
        let numeric = (moved(STEP) - moved(-STEP)) / (2.0 * STEP);
        let off = (slope.sum - numeric).abs() / numeric.abs();
        println!("{}: {} and {numeric}, {off:e}", config.architecture.name(), slope.sum);
        assert!(
            off < TOLERANCE,
            "{}: {} and {numeric}",
            config.architecture.name(),
            slope.sum
        );
    }
}
