//! Between networks that are trained and networks that run.

use super::any_network::Network;
use crate::error::NetworkError;
use burn::module::{Module, ModuleMapper, Param};
use burn::tensor::{Device, Tensor, TensorData};
use deepsft_inference::{FoldedNetwork, WeightArray};
use std::collections::BTreeMap;

impl Network {
    /// The finished network, for those who only run it. Its weights are read from the device at once: native only, or a
    /// network on the CPU.
    ///
    /// ```
    /// use deepsft_inference::{DeviceKind, NetworkConfig};
    /// use deepsft_network::{Network, start_device};
    /// use deepsft_geometry::training_camera;
    /// let (device, _) = pollster::block_on(start_device(DeviceKind::Cpu))?;
    /// let config = NetworkConfig::compact([297.0, 210.0], &training_camera());
    /// let folded = Network::new(&config, &device).folded();
    /// assert_eq!(folded.weights["main.patch.weight"].shape, [32, 48, 1, 1]);
    /// # Ok::<(), deepsft_network::NetworkError>(())
    /// ```
    pub fn folded(&self) -> FoldedNetwork {
        FoldedNetwork {
            config: self.config().clone(),
            weights: self.valid().fold().weights(),
        }
    }

    /// A finished network on `device`: it says the same and can go on learning.
    ///
    /// # Errors
    /// [`NetworkError::Weights`] when weights are missing, too many or of another shape.
    pub fn from_folded(folded: &FoldedNetwork, device: &Device) -> Result<Self, NetworkError> {
        let refused = |reason: String| NetworkError::Weights {
            file: "the network".to_owned(),
            reason,
        };
        let mut loading = Loading {
            path: Vec::new(),
            weights: folded
                .weights
                .iter()
                .map(|(name, array)| (name.as_str(), array))
                .collect(),
            problem: None,
        };
        let network = Self::new_folded(&folded.config, &Device::flex()).map(&mut loading);
        let left = loading.weights.keys().next();
        let problem = loading
            .problem
            .or_else(|| left.map(|name| format!("{name} has no place in it")));
        problem.map_or_else(|| Ok(network.fork(device)), |problem| Err(refused(problem)))
    }
}

struct Loading<'a> {
    path: Vec<String>,
    /// Those that have found no place yet.
    weights: BTreeMap<&'a str, &'a WeightArray>,
    problem: Option<String>,
}

impl ModuleMapper for Loading<'_> {
    fn enter_module(&mut self, name: &str, _container: &str) {
        self.path.push(name.to_owned());
    }

    fn exit_module(&mut self, _name: &str, _container: &str) {
        self.path.pop();
    }

    fn map_float<const D: usize>(&mut self, param: Param<Tensor<D>>) -> Param<Tensor<D>> {
        let path = self.path.join(".");
        let (id, shape, device) = (param.id, param.val().dims(), param.val().device());
        let Some(array) = self.weights.remove(path.as_str()) else {
            self.problem.get_or_insert_with(|| format!("{path} is missing"));
            return param;
        };
        if array.shape != shape {
            let theirs = &array.shape;
            self.problem
                .get_or_insert_with(|| format!("{path} has the shape {theirs:?}, expected {shape:?}"));
            return param;
        }
        let tensor = Tensor::from_data(TensorData::new(array.values.clone(), shape), &device);
        param.transform_for_load(tensor, id)
    }
}
