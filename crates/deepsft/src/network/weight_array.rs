//! The network's weights as plain arrays, for other programs.

use super::any_network::Network;
use burn::module::{Module, ModuleVisitor, Param};
use burn::tensor::{Tensor, TensorData};

/// One array of weights.
#[derive(Clone, Debug, PartialEq)]
pub struct WeightArray {
    /// Its path in the network: `main.encode8.first.weight`, `main.bins.0.bias`.
    pub name: String,
    /// Its shape: [out, in, k, k] for filters, [out] for biases.
    pub shape: Vec<usize>,
    /// Its values, the last axis fastest.
    pub values: Vec<f32>,
}

impl Network {
    /// All weights, in the order of the layers. They are read from the device at once: native only, or a network on
    /// the CPU.
    ///
    /// ```
    /// use deepsft::{DeviceKind, NetworkConfig, start_device};
    /// use deepsft_geometry::training_camera;
    /// let (device, _) = pollster::block_on(start_device(DeviceKind::Cpu))?;
    /// let arrays = Network::new(&NetworkConfig::compact([297.0, 210.0], &training_camera()), &device).fold().weight_arrays();
    /// assert_eq!((arrays[0].name.as_str(), &arrays[0].shape[..]), ("main.patch.weight", &[32, 48, 1, 1][..]));
    /// # Ok::<(), deepsft::DeepSftError>(())
    /// ```
    pub fn weight_arrays(&self) -> Vec<WeightArray> {
        let mut arrays = Vec::new();
        self.each_weight(|name, data| {
            let shape = data.shape().to_vec();
            // Of the type that they were just converted to: always there.
            let values = data.convert::<f32>().try_to_vec().unwrap_or_default();
            let name = name.to_owned();
            arrays.push(WeightArray { name, shape, values });
        });
        arrays
    }

    /// Calls `take` with the path of each weight and its values in the precision they have, in the order of the layers.
    /// They are read as those of [`Network::weight_arrays`].
    pub fn each_weight(&self, take: impl FnMut(&str, TensorData)) {
        self.visit(&mut Reader { path: Vec::new(), take });
    }
}

struct Reader<F> {
    path: Vec<String>,
    take: F,
}

impl<F: FnMut(&str, TensorData)> ModuleVisitor for Reader<F> {
    fn enter_module(&mut self, name: &str, _container: &str) {
        self.path.push(name.to_owned());
    }

    fn exit_module(&mut self, _name: &str, _container: &str) {
        self.path.pop();
    }

    fn visit_float<const D: usize>(&mut self, param: &Param<Tensor<D>>) {
        (self.take)(&self.path.join("."), param.val().into_data());
    }
}
