//! A network that begins with the trunk of another one: what sees edges and shapes is learnt already.

use super::any_network::Network;
use super::compact::VARIANCE_FLOOR;
use crate::error::NetworkError;
use burn::module::{Module, ModuleMapper, Param};
use burn::tensor::{Distribution, Tensor, TensorData};
use deepsft_inference::Weights;
use std::collections::HashSet;

/// Heads of the main block, which read one template's positions off the trunk's features.
const HEADS: [&str; 2] = ["main.bins.", "main.offset."];

/// Root mean square of the features that heads are given, of noise (those of the shipped `poster-a4`: 3.4).
const FEATURE_SIZE: f32 = 3.6;

/// Side of the image of noise, pixels.
const NOISE_PX: usize = 192;

impl Network {
    /// The same network with the trunk of another one: the convolutions of the main block without its heads. `weights` are the
    /// folded ones of a compact network of the same widths or of a [`crate::DescriptorNetwork`].
    ///
    /// A filter is unfolded into a raw one of length one, as new ones have, and its gain: the same function, and the learning
    /// rate turns it as it turns a new one. Then the trunk is scaled, which changes nothing but one factor behind the patches,
    /// until its features are as large as those of a trained network: descriptors are free in their length (of noise the
    /// features of `any-picture` are 12 times as large, and new heads would begin with errors of a thousand pixels).
    ///
    /// Waits for the device: native only.
    ///
    /// # Errors
    /// [`NetworkError::Weights`], which says that they come from the file `file`, for weights that have no such trunk, and for a network that is
    /// not compact or folded.
    pub fn with_trunk(self, file: &str, weights: &Weights) -> Result<Self, NetworkError> {
        let refused = |reason: String| NetworkError::Weights {
            file: file.to_owned(),
            reason,
        };
        let compact = self.as_compact();
        let Some(device) = compact.and_then(|compact| compact.devices().into_iter().next()) else {
            return Err(refused("only a compact network can begin with a trunk".to_owned()));
        };
        let mut unfolding = Unfolding::new(weights);
        let begun = self.map(&mut unfolding);
        unfolding.refuse_what_is_left();
        if let Some(problem) = unfolding.problem {
            return Err(refused(problem));
        }
        if !unfolding.has_gains {
            return Err(refused("a folded network cannot begin with a trunk".to_owned()));
        }
        let noise = Tensor::random([1, 3, NOISE_PX, NOISE_PX], Distribution::Uniform(0.0, 1.0), &device);
        let size = begun.as_compact().map(|compact| compact.feature_size(noise));
        unfolding.scale = FEATURE_SIZE / size.unwrap_or_default().max(f32::MIN_POSITIVE);
        Ok(begun.map(&mut unfolding))
    }
}

fn of_trunk(path: &str) -> bool {
    path.starts_with("main.") && !HEADS.iter().any(|head| path.starts_with(head))
}

/// Puts folded weights into the trunk of a network.
struct Unfolding<'a> {
    path: Vec<String>,
    folded: &'a Weights,
    /// What the features are multiplied by.
    scale: f32,
    /// Whether a gain was met: a folded network has none.
    has_gains: bool,
    /// The first weights that do not fit.
    problem: Option<String>,
    /// Paths of the folded weights that have a place in the network.
    placed: HashSet<String>,
}

impl<'a> Unfolding<'a> {
    fn new(folded: &'a Weights) -> Self {
        Self {
            path: Vec::new(),
            folded,
            scale: 1.0,
            has_gains: false,
            problem: None,
            placed: HashSet::new(),
        }
    }

    /// A deeper trunk is another function.
    fn refuse_what_is_left(&mut self) {
        let left = self
            .folded
            .keys()
            .find(|path| of_trunk(path) && !self.placed.contains(*path));
        let problem = left.map(|path| format!("its {path} has no place in this network"));
        self.problem = self.problem.take().or(problem);
    }

    /// The values of the weights at `path`, which have the shape `shape`.
    fn values(&mut self, path: &str, shape: &[usize]) -> Result<Vec<f32>, String> {
        let layer = path.trim_end_matches("gain");
        let stored_path = if layer == path {
            path.to_owned()
        } else {
            format!("{layer}weight")
        };
        let stored = self.folded.get(&stored_path);
        let stored = stored.ok_or_else(|| format!("it has no {stored_path}, as the trunk of a compact network has"))?;
        self.placed.insert(stored_path.clone());
        // A gain is one number for each filter.
        if stored.shape[..shape.len().min(stored.shape.len())] != *shape {
            let theirs = &stored.shape;
            return Err(format!(
                "its {stored_path} has the shape {theirs:?}, this network's has {shape:?}"
            ));
        }
        let mut values = stored.values.clone();
        if path.ends_with("bias") {
            // What leaves a layer is scaled, from the first layer behind the patches on. relu keeps factors.
            let scale = if path == "main.patch.bias" { 1.0 } else { self.scale };
            return Ok(values.into_iter().map(|value| scale * value).collect());
        }
        let filters = shape[0].max(1);
        let fan_in = values.len() / filters;
        let scale = if path == "main.down8.gain" { self.scale } else { 1.0 };
        let mut gains = Vec::with_capacity(filters);
        for filter in values.chunks_mut(fan_in.max(1)) {
            let mean = filter.iter().sum::<f32>() / filter.len() as f32;
            filter.iter_mut().for_each(|value| *value -= mean);
            let length = filter.iter().map(|value| value * value).sum::<f32>().sqrt();
            filter
                .iter_mut()
                .for_each(|value| *value /= length.max(f32::MIN_POSITIVE));
            gains.push(scale * length * (1.0 + VARIANCE_FLOOR as f32).sqrt());
        }
        Ok(if layer == path { values } else { gains })
    }
}

impl ModuleMapper for Unfolding<'_> {
    fn enter_module(&mut self, name: &str, _container: &str) {
        self.path.push(name.to_owned());
    }

    fn exit_module(&mut self, _name: &str, _container: &str) {
        self.path.pop();
    }

    fn map_float<const D: usize>(&mut self, param: Param<Tensor<D>>) -> Param<Tensor<D>> {
        let path = self.path.join(".");
        if self.problem.is_some() || !of_trunk(&path) {
            return param;
        }
        self.has_gains |= path.ends_with(".gain");
        let (id, shape, device) = (param.id, param.val().dims(), param.val().device());
        match self.values(&path, &shape) {
            Ok(values) => {
                let tensor = Tensor::from_data(TensorData::new(values, shape), &device);
                param.transform_for_load(tensor, id)
            }
            Err(problem) => {
                self.problem = Some(problem);
                param
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::DescriptorNetwork;
    use burn::tensor::Device;
    use deepsft_geometry::training_camera;
    use deepsft_inference::{Architecture, CompactConfig, NetworkConfig, R50FConfig};

    /// Adds noise to the trunk: raw filters, gains and biases.
    #[derive(Default)]
    struct Noise(Vec<String>);
    impl ModuleMapper for Noise {
        fn enter_module(&mut self, name: &str, _container: &str) {
            self.0.push(name.to_owned());
        }

        fn exit_module(&mut self, _name: &str, _container: &str) {
            self.0.pop();
        }

        fn map_float<const D: usize>(&mut self, param: Param<Tensor<D>>) -> Param<Tensor<D>> {
            if !of_trunk(&self.0.join(".")) {
                return param;
            }
            param.map(|weights| weights.random_like(Distribution::Normal(0.0, 0.1)) + weights)
        }
    }

    fn config(channels: [usize; 4], blocks_at_32: usize) -> NetworkConfig {
        let shape = CompactConfig {
            channels,
            blocks_at_32,
            ..CompactConfig::default()
        };
        NetworkConfig::new(Architecture::Compact(shape), [200.0, 150.0], &training_camera())
    }

    fn weights(network: Network) -> Weights {
        network.folded().weights
    }

    #[test]
    fn an_unfolded_trunk_is_the_folded_one_up_to_a_factor_and_its_filters_have_length_one() {
        let device = Device::flex();
        let images = Tensor::random([2, 3, 96, 64], Distribution::Uniform(0.0, 1.0), &device);
        let fresh = Network::new(&config([8, 12, 16, 20], 2), &device);
        let trained = fresh.clone().map(&mut Noise::default());
        let begun = fresh.clone().with_trunk("w", &weights(trained.clone())).unwrap();
        // New heads have no biases: the logits of their bins tell the features, up to the factor.
        let bins = |network: &Network| {
            let [u, v, d] = network.as_compact().unwrap().forward(images.clone()).bins;
            Tensor::cat(vec![u, v, d], 1)
        };
        let [ours, theirs] = [&begun, &trained.fold()].map(bins);
        let product = |a: &Tensor<4>, b: &Tensor<4>| (a.clone() * b.clone()).sum().into_scalar::<f32>();
        let factor = product(&ours, &theirs) / product(&theirs, &theirs);
        let size = (product(&ours, &ours) / ours.dims().iter().product::<usize>() as f32).sqrt();
        let off = (ours - theirs * factor).abs().max().into_scalar::<f32>();
        assert!(size > 0.01 && off < 1e-5, "{size} {off}");
        // Other noise than the scale was taken from: the borders of small images would tell.
        let noise = Tensor::random([1, 3, NOISE_PX, NOISE_PX], Distribution::Uniform(0.0, 1.0), &device);
        let size = begun.as_compact().unwrap().feature_size(noise);
        assert!((size / FEATURE_SIZE - 1.0).abs() < 0.1, "{size}");
        let fresh = fresh.weights();
        for (name, begun) in begun.weights() {
            assert_eq!(begun != fresh[&name], of_trunk(&name), "{name}");
            if of_trunk(&name) && name.ends_with("weight") {
                let square: f32 = begun.values.iter().map(|value| value * value).sum();
                assert!((square / begun.shape[0] as f32 - 1.0).abs() < 1e-4, "{name}");
            }
        }
    }

    #[test]
    fn the_trunk_of_the_descriptor_network_fits_the_default_network() {
        let device = Device::flex();
        let weights = DescriptorNetwork::new(&device).folded_weights();
        let network = Network::new(&NetworkConfig::compact([200.0, 150.0], &training_camera()), &device);
        let before = network.clone();
        let begun = network.with_trunk("w", &weights).unwrap();
        let first = "main.patch.weight";
        assert_ne!(begun.weights()[first], before.weights()[first]);
    }

    #[test]
    fn weights_without_this_trunk_are_refused() {
        let device = Device::flex();
        let network = || Network::new(&config([8, 12, 16, 20], 2), &device);
        let r50f = || {
            let architecture = Architecture::R50F(R50FConfig::narrow(32));
            Network::new(
                &NetworkConfig::new(architecture, [200.0, 150.0], &training_camera()),
                &device,
            )
        };
        for (network, weights, part) in [
            (network(), Weights::new(), "no main.patch.weight"),
            (network(), weights(r50f()), "no main.patch.weight"),
            (
                network(),
                weights(Network::new(&config([8, 12, 16, 24], 2), &device)),
                "main.down32.weight has the shape [24, 16, 3, 3]",
            ),
            (
                network(),
                weights(Network::new(&config([8, 12, 16, 20], 3), &device)),
                "main.encode32.2.",
            ),
            (r50f(), weights(network()), "only a compact network"),
            (network().fold(), weights(network()), "a folded network"),
        ] {
            let error = network.with_trunk("w", &weights).unwrap_err().to_string();
            assert!(error.starts_with("w ") && error.contains(part), "{error}");
        }
    }
}
