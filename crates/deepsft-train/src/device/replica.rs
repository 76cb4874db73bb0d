//! Copies of a network on other devices, and the running statistics of batch normalisation that they bring back.

use burn::module::{Module, ModuleMapper, ModuleVisitor, Param, ParamId};
use burn::tensor::{Device, Tensor};
use deepsft_network::Network;
use std::collections::BTreeMap;

/// Names of the running statistics in burn's batch normalisation.
const STATISTICS: [&str; 2] = ["running_mean", "running_var"];

/// A copy of `network`, which is on a differentiable device, on another one or the same, with the same identities of
/// weights but a graph and running statistics of its own. (Clones share their running statistics; leaving
/// differentiation and coming back makes new ones.)
pub fn replica(network: &Network, device: &Device) -> Network {
    network.valid().train().fork(device)
}

/// The running means and variances of a network's batch normalisation, [channels] each.
#[derive(Default)]
pub struct RunningStatistics(BTreeMap<ParamId, Tensor<1>>);

impl RunningStatistics {
    /// Those of `network`, which is on a plain device.
    pub fn of(network: &Network) -> Self {
        let mut collect = Collect::default();
        network.visit(&mut collect);
        collect.found
    }

    /// The mean over devices, brought to `device`: what burn's own running state is over threads, but always summed in
    /// the devices' order.
    pub fn mean(of_devices: Vec<Self>, device: &Device) -> Self {
        let count = of_devices.len() as f64;
        let mut sums = BTreeMap::new();
        for (identity, value) in of_devices.into_iter().flat_map(|statistics| statistics.0) {
            let value = value.to_device(device);
            let sum = match sums.remove(&identity) {
                Some(sum) => sum + value,
                None => value,
            };
            sums.insert(identity, sum);
        }
        Self(
            sums.into_iter()
                .map(|(identity, sum)| (identity, sum / count))
                .collect(),
        )
    }

    /// `network`, which is on a differentiable device, with these for its own.
    pub fn put_into(self, network: Network) -> Network {
        if self.0.is_empty() {
            return network;
        }
        // Statistics that wait in the running states are averaged in now, lest they come over these later.
        drop(network.valid());
        network.map(&mut Put(self))
    }
}

#[derive(Default)]
struct Collect {
    /// Whether what is visited is within a running statistic.
    within: bool,
    found: RunningStatistics,
}

impl ModuleVisitor for Collect {
    fn enter_module(&mut self, name: &str, _container: &str) {
        self.within = STATISTICS.contains(&name);
    }

    fn exit_module(&mut self, _name: &str, _container: &str) {
        self.within = false;
    }

    fn visit_float<const D: usize>(&mut self, param: &Param<Tensor<D>>) {
        if self.within {
            let value = param.val();
            let channels = value.shape().num_elements();
            self.found.0.insert(param.id, value.reshape([channels]));
        }
    }
}

struct Put(RunningStatistics);

impl ModuleMapper for Put {
    fn map_float<const D: usize>(&mut self, param: Param<Tensor<D>>) -> Param<Tensor<D>> {
        let Some(value) = self.0.0.remove(&param.id) else {
            return param;
        };
        param.map(|old| Tensor::from_inner(value.reshape(old.shape())))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use deepsft::{Architecture, NetworkConfig, R50FConfig};

    fn network(device: &Device) -> Network {
        let r50f = Architecture::R50F(R50FConfig::narrow(64));
        Network::new(
            &NetworkConfig::new(r50f, [297.0, 210.0], &deepsft_geometry::training_camera()),
            device,
        )
    }

    #[test]
    fn copies_have_running_statistics_of_their_own_and_the_mean_of_them_comes_back() {
        let (plain, device) = (Device::flex(), Device::flex().autodiff());
        let network = network(&device);
        let copies = [replica(&network, &device), replica(&network, &device)];
        let image = |value: f64| Tensor::<4>::full([1, 3, 270, 480], value, &device);
        // Means in the first layer's bias alone: an even image through a filter with padding has some spread.
        copies[0].forward_maps(image(0.2));
        copies[1].forward_maps(image(0.8));
        let first = |network: &Network| -> Vec<f32> {
            let statistics = RunningStatistics::of(&network.valid());
            assert!(statistics.0.len() > 50, "{}", statistics.0.len());
            let flat: Vec<Tensor<1>> = statistics.0.into_values().collect();
            Tensor::cat(flat, 0).into_data().try_to_vec().unwrap()
        };
        let before = first(&network);
        let [a, b] = [first(&copies[0]), first(&copies[1])];
        assert!(a != b && a != before);
        let statistics = copies.iter().map(|copy| RunningStatistics::of(&copy.valid())).collect();
        let network = RunningStatistics::mean(statistics, &plain).put_into(network);
        let after = first(&network);
        for ((a, b), mean) in a.iter().zip(&b).zip(&after) {
            assert!(
                ((a + b) / 2.0 - mean).abs() <= 1e-6 * mean.abs().max(1.0),
                "{a} {b} {mean}"
            );
        }
        // One copy's come back bit for bit.
        let statistics = vec![RunningStatistics::of(&copies[0].valid())];
        let network = RunningStatistics::mean(statistics, &plain).put_into(network);
        assert!(first(&network) == a);
    }
}
