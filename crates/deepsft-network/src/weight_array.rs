//! The network's weights one by one.

use super::any_network::Network;
use burn::module::{Module, ModuleVisitor, Param};
use burn::store::burn_pack::Reader as PackReader;
use burn::tensor::{Bytes, Tensor, TensorData};
use deepsft_inference::{WeightArray, Weights};

impl Network {
    /// All weights by their paths. They are read from the device at once: native only, or a network on the CPU.
    pub fn weights(&self) -> Weights {
        weights_of(self)
    }

    /// Calls `take` with the path of each weight and its values in the precision they have, in the order of the layers.
    /// They are read as those of [`Network::weights`].
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

/// Whether all tensors of a file of weights are of floating-point numbers: burn panics where it is to load others into them.
pub(crate) fn check_weights(bytes: &[u8]) -> Result<(), String> {
    let reader = PackReader::from_bytes(Bytes::from_bytes_vec(bytes.to_vec())).map_err(|e| e.to_string())?;
    for tensor in reader.into_tensors().map_err(|e| e.to_string())? {
        let (name, kind, ..) = tensor.into_parts().map_err(|e| e.to_string())?;
        if !kind.is_float() {
            return Err(format!("{name} holds {kind:?}, expected floating-point numbers"));
        }
    }
    Ok(())
}
