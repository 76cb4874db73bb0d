//! Exponential moving average of a network's weights.

use burn::module::{Module, ModuleMapper, ModuleVisitor, Param};
use burn::tensor::Tensor;
use deepsft_network::Network;

/// The average of the weights over the last iterations: what is evaluated and shipped. In the first
/// ones it forgets faster, so that it leaves the start behind: iteration k keeps (1 + k) / (10 + k) at most.
#[derive(Clone)]
pub(super) struct WeightAverage {
    decay: f64,
    steps: u64,
    /// All weights in the module's order, on the device of the network.
    values: Vec<Tensor<1>>,
}

impl WeightAverage {
    /// An average that stands at the weights of `network` after `steps` steps; `decay` per iteration in the long run.
    pub fn new(network: &Network, decay: f64, steps: u64) -> Self {
        Self {
            decay,
            steps,
            values: weights(network),
        }
    }

    /// Takes in the weights after a step.
    pub fn update(&mut self, network: &Network) {
        self.steps += 1;
        if self.decay == 0.0 {
            // The average is the network itself.
            self.values.clear();
            return;
        }
        let steps = self.steps as f64;
        let keep = self.decay.min((1.0 + steps) / (10.0 + steps));
        for (average, now) in self.values.iter_mut().zip(weights(network)) {
            // What is frozen stays bit for bit what it is: nothing is added to it.
            *average = average.clone() + (now - average.clone()) * (1.0 - keep);
        }
    }

    /// `network` with the averaged weights.
    pub fn apply(&self, network: Network) -> Network {
        network.map(&mut Replace(self.values.iter()))
    }
}

struct Replace<'a>(std::slice::Iter<'a, Tensor<1>>);

impl ModuleMapper for Replace<'_> {
    fn map_float<const D: usize>(&mut self, param: Param<Tensor<D>>) -> Param<Tensor<D>> {
        let Some(values) = self.0.next() else { return param };
        param.map(|old| values.clone().reshape(old.dims()).to_device(&old.device()))
    }
}

struct Collect(Vec<Tensor<1>>);

impl ModuleVisitor for Collect {
    fn visit_float<const D: usize>(&mut self, param: &Param<Tensor<D>>) {
        self.0.push(param.val().inner().flatten(0, D - 1));
    }
}

/// All weights in the module's order.
fn weights(network: &Network) -> Vec<Tensor<1>> {
    let mut all = Collect(Vec::new());
    network.visit(&mut all);
    all.0
}

#[cfg(test)]
mod tests {
    use super::*;
    use burn::tensor::Device;

    fn network() -> Network {
        Network::new(
            &deepsft::NetworkConfig::compact([297.0, 210.0], &deepsft_geometry::training_camera()),
            &Device::flex(),
        )
    }

    #[test]
    fn the_average_moves_a_known_fraction_towards_the_new_weights() {
        let (first, second) = (network(), network());
        let mut average = WeightAverage::new(&first, 0.9, 0);
        average.update(&second);
        // After one step the fraction kept is (1 + 1) / (10 + 1).
        let values = |network: &Network| -> Vec<Vec<f32>> {
            let weights = weights(network).into_iter();
            weights
                .map(|weights| weights.into_data().try_to_vec().unwrap())
                .collect()
        };
        let (a, b) = (values(&first), values(&second));
        let got = values(&average.apply(first));
        for ((a, b), got) in a.iter().flatten().zip(b.iter().flatten()).zip(got.iter().flatten()) {
            assert!((got - (a * 2.0 / 11.0 + b * 9.0 / 11.0)).abs() < 1e-6);
        }
    }
}
