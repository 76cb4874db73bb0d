//! The network's weights one by one.

use super::any_network::Network;
use burn::module::{Module, ModuleVisitor, Param};
use burn::tensor::{Tensor, TensorData};
use deepsft_inference::{WeightArray, Weights};

impl Network {
    /// Reads all weights by their paths. They are read from the device at once: native only, or a network on the CPU.
    pub fn weights(&self) -> Weights {
        weights_of(self)
    }

    /// Visits each weight with its path and its values, in the order of the layers. They are read as those of
    /// [`Network::weights`].
    pub fn each_weight(&self, take: impl FnMut(&str, TensorData)) {
        self.visit(&mut Reader { path: Vec::new(), take });
    }
}

/// All weights of a module by their paths.
pub(crate) fn weights_of(module: &impl Module) -> Weights {
    let mut weights = Weights::new();
    let take = |name: &str, data: TensorData| {
        let shape = data.shape().to_vec();
        // Of the type that they were just converted to: always there.
        let values = data.convert::<f32>().try_to_vec().unwrap_or_default();
        weights.insert(name.to_owned(), WeightArray { shape, values });
    };
    module.visit(&mut Reader { path: Vec::new(), take });
    weights
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
