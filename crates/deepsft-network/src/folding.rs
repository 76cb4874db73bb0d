//! Between networks that are trained and networks that run.

use super::any_network::Network;
use super::convolution_layer::{NORMALISATION_EPSILON, VARIANCE_FLOOR};
use super::weight_array::weights_of;
use crate::error::NetworkError;
use burn::module::{Module, ModuleMapper, Param};
use burn::tensor::{Device, Tensor, TensorData};
use deepsft_inference::{FoldedNetwork, WeightArray, Weights};
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
            weights: folded(weights_of(&self.valid())),
        }
    }

    /// Folds the network for inference: the same function, with weight standardisation and batch normalisation baked into the
    /// convolutions. Reads the weights as [`Network::folded`] does.
    pub fn fold(self) -> Self {
        let device = self.devices().into_iter().next().unwrap_or_else(Device::flex);
        Self::with_init(self.config(), &device, false)
            .loaded(&self.folded().weights)
            .0
    }

    /// A finished network on `device`: it says the same and can go on learning.
    ///
    /// # Errors
    /// [`NetworkError::Weights`] when weights are missing, too many or of another shape.
    pub fn from_folded(folded: &FoldedNetwork, device: &Device) -> Result<Self, NetworkError> {
        let file = || "the network".to_owned();
        match Self::with_init(&folded.config, &Device::flex(), false).loaded(&folded.weights) {
            (network, None) => Ok(network.fork(device)),
            (_, Some(reason)) => Err(NetworkError::Weights { file: file(), reason }),
        }
    }

    /// The network with these weights, and the first that does not fit.
    pub(crate) fn loaded(self, weights: &Weights) -> (Self, Option<String>) {
        let mut loading = Loading {
            path: Vec::new(),
            weights: weights.iter().map(|(name, array)| (name.as_str(), array)).collect(),
            problem: None,
        };
        let network = self.map(&mut loading);
        let left = loading.weights.keys().next();
        let left = left.map(|name| format!("{name} has no place in it"));
        (network, loading.problem.or(left))
    }
}

/// The weights of the same function without standardisation and batch normalisation.
pub fn folded(mut weights: Weights) -> Weights {
    let layers: Vec<String> = (weights.keys())
        .filter_map(|path| Some(path.strip_suffix(".weight")?.to_owned()))
        .collect();
    for layer in layers {
        let mut take = |part: &str| {
            let array = weights.remove(&format!("{layer}.{part}"));
            array.map(|array| array.values.into_iter().map(f64::from).collect::<Vec<f64>>())
        };
        let (gain, statistics) = (
            take("gain"),
            ["gamma", "beta", "running_mean", "running_var"].map(|part| take(&format!("normalisation.{part}"))),
        );
        if let Some(gains) = gain {
            scale(&mut weights, &layer, |k, filter| {
                let mean = filter.iter().copied().map(f64::from).sum::<f64>() / filter.len() as f64;
                let square: f64 = filter.iter().map(|&value| (f64::from(value) - mean).powi(2)).sum();
                (mean, gains[k] / (square + VARIANCE_FLOOR).sqrt())
            });
        }
        // gamma (w x + b - mean) / sqrt(variance + epsilon) + beta is a convolution again.
        if let [Some(gamma), Some(beta), Some(mean), Some(variance)] = statistics {
            let factor = |k: usize| gamma[k] / (variance[k] + NORMALISATION_EPSILON).sqrt();
            scale(&mut weights, &layer, |k, _| (0.0, factor(k)));
            let biases = weights.get_mut(&format!("{layer}.bias")).into_iter();
            for (k, bias) in biases.flat_map(|array| &mut array.values).enumerate() {
                *bias = ((f64::from(*bias) - mean[k]) * factor(k) + beta[k]) as f32;
            }
        }
    }
    weights
}

/// Subtracts a number from the values of each filter of `layer` and multiplies them by another one.
fn scale(weights: &mut Weights, layer: &str, by: impl Fn(usize, &[f32]) -> (f64, f64)) {
    let Some(WeightArray { shape, values }) = weights.get_mut(&format!("{layer}.weight")) else {
        return;
    };
    let fan_in = shape[1..].iter().product::<usize>().max(1);
    for (k, filter) in values.chunks_mut(fan_in).enumerate() {
        let (offset, factor) = by(k, filter);
        filter
            .iter_mut()
            .for_each(|value| *value = ((f64::from(*value) - offset) * factor) as f32);
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
