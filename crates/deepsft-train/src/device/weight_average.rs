//! Exponential moving average of a network's weights.

use burn::module::{Module, ModuleMapper, Param};
use burn::tensor::{Tensor, TensorData};
use deepsft_network::Network;

/// The average of the weights over the last iterations: what is evaluated and shipped. In the first
/// ones it forgets faster, so that it leaves the start behind: iteration k keeps (1 + k) / (10 + k) at most.
#[derive(Clone)]
pub struct WeightAverage {
    decay: f64,
    steps: u64,
    values: Vec<Vec<f32>>,
}

impl WeightAverage {
    /// An average that starts at `network`; `decay` per iteration in the long run.
    pub fn new(network: &Network, decay: f64) -> Self {
        Self {
            decay,
            steps: 0,
            values: weights(network),
        }
    }

    /// Continues an average that was saved as a network after `steps` steps.
    pub fn resume(average: &Network, decay: f64, steps: u64) -> Self {
        Self {
            decay,
            steps,
            values: weights(average),
        }
    }

    /// Takes in the weights after a step.
    pub fn update(&mut self, network: &Network) {
        self.steps += 1;
        if self.decay == 0.0 {
            // The average is the network itself: nothing to fetch from its device.
            self.values.clear();
            return;
        }
        let steps = self.steps as f64;
        let keep = self.decay.min((1.0 + steps) / (10.0 + steps)) as f32;
        for (average, now) in self.values.iter_mut().zip(weights(network)) {
            // What is frozen stays bit for bit what it is: the sum of its two parts need not.
            for (a, n) in average.iter_mut().zip(now).filter(|(a, n)| **a != *n) {
                *a = *a * keep + n * (1.0 - keep);
            }
        }
    }

    /// `network` with the averaged weights.
    pub fn apply(&self, network: Network) -> Network {
        network.map(&mut Replace {
            values: self.values.iter(),
        })
    }
}

struct Replace<'a> {
    values: std::slice::Iter<'a, Vec<f32>>,
}

impl ModuleMapper for Replace<'_> {
    fn map_float<const D: usize>(&mut self, param: Param<Tensor<D>>) -> Param<Tensor<D>> {
        let Some(values) = self.values.next() else { return param };
        param.map(|old| {
            let data = TensorData::new(values.clone(), old.shape());
            Tensor::from_data(data, &old.device())
        })
    }
}

/// All weights in the module's order.
fn weights(network: &Network) -> Vec<Vec<f32>> {
    let mut all = Vec::new();
    // Of the type that they were just converted to: always there.
    network.each_weight(|_, data| all.push(data.convert::<f32>().try_to_vec().unwrap_or_default()));
    all
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
        let mut average = WeightAverage::new(&first, 0.9);
        average.update(&second);
        // After one step the fraction kept is (1 + 1) / (10 + 1).
        let (a, b) = (weights(&first), weights(&second));
        let got = weights(&average.apply(first));
        for ((a, b), got) in a.iter().flatten().zip(b.iter().flatten()).zip(got.iter().flatten()) {
            assert!((got - (a * 2.0 / 11.0 + b * 9.0 / 11.0)).abs() < 1e-6);
        }
    }
}
