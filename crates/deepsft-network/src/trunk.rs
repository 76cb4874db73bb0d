//! A network that begins with the trunk of another one: what sees edges and shapes is learnt already.

use super::any_network::Network;
use super::convolution_layer::VARIANCE_FLOOR;
use crate::error::NetworkError;
use burn::module::Module;
use burn::tensor::{Distribution, Tensor};
use deepsft_inference::{WeightArray, Weights};

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
        let Some(device) = self
            .as_compact()
            .and_then(|compact| compact.devices().into_iter().next())
        else {
            return Err(refused("only a compact network can begin with a trunk".to_owned()));
        };
        let own = self.weights();
        if !own.contains_key("main.patch.gain") {
            return Err(refused("a folded network cannot begin with a trunk".to_owned()));
        }
        let begun = self.loaded(&unfolded(&own, weights, 1.0).map_err(refused)?).0;
        let noise = Tensor::random([1, 3, NOISE_PX, NOISE_PX], Distribution::Uniform(0.0, 1.0), &device);
        let size = begun.as_compact().map(|compact| compact.feature_size(noise));
        let scale = FEATURE_SIZE / size.unwrap_or_default().max(f32::MIN_POSITIVE);
        Ok(begun.loaded(&unfolded(&own, weights, scale).map_err(refused)?).0)
    }
}

fn of_trunk(path: &str) -> bool {
    path.starts_with("main.") && !HEADS.iter().any(|head| path.starts_with(head))
}

/// The weights `own` with those of another trunk, which are folded, in place of the trunk's; its features are multiplied by `scale`.
fn unfolded(own: &Weights, folded: &Weights, scale: f32) -> Result<Weights, String> {
    let mut weights = own.clone();
    for (path, WeightArray { shape, values }) in weights.iter_mut().filter(|(path, _)| of_trunk(path)) {
        let layer = path.strip_suffix("gain");
        let stored_path = layer.map_or_else(|| path.clone(), |layer| format!("{layer}weight"));
        let stored = folded.get(&stored_path);
        let stored = stored.ok_or_else(|| format!("it has no {stored_path}, as the trunk of a compact network has"))?;
        // A gain is one number for each filter.
        if stored.shape[..shape.len().min(stored.shape.len())] != *shape {
            let theirs = &stored.shape;
            return Err(format!(
                "its {stored_path} has the shape {theirs:?}, this network's has {shape:?}"
            ));
        }
        values.clone_from(&stored.values);
        if path.ends_with("bias") {
            // What leaves a layer is scaled, from the first layer behind the patches on. relu keeps factors.
            let scale = if path == "main.patch.bias" { 1.0 } else { scale };
            values.iter_mut().for_each(|value| *value *= scale);
            continue;
        }
        let scale = if path == "main.down8.gain" { scale } else { 1.0 };
        let mut gains = Vec::new();
        for filter in values.chunks_mut((stored.values.len() / shape[0].max(1)).max(1)) {
            let mean = filter.iter().sum::<f32>() / filter.len() as f32;
            filter.iter_mut().for_each(|value| *value -= mean);
            let length = filter.iter().map(|value| value * value).sum::<f32>().sqrt();
            filter
                .iter_mut()
                .for_each(|value| *value /= length.max(f32::MIN_POSITIVE));
            gains.push(scale * length * (1.0 + VARIANCE_FLOOR as f32).sqrt());
        }
        if layer.is_some() {
            *values = gains;
        }
    }
    // A deeper trunk is another function.
    match folded.keys().find(|path| of_trunk(path) && !own.contains_key(*path)) {
        Some(left) => Err(format!("its {left} has no place in this network")),
        None => Ok(weights),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::DescriptorNetwork;
    use burn::tensor::Device;
    use deepsft_geometry::training_camera;
    use deepsft_inference::{Architecture, CompactConfig, NetworkConfig, R50FConfig};

    /// The network with noise added to its trunk: raw filters, gains and biases.
    fn noisy(network: Network) -> Network {
        let mut weights = network.weights();
        for (_, array) in weights.iter_mut().filter(|(path, _)| of_trunk(path)) {
            let noise = Distribution::Normal(0.0, 0.1);
            let noise = Tensor::<1>::random([array.values.len()], noise, &Device::flex()).into_data();
            let values = array.values.iter_mut().zip(noise.iter::<f32>());
            values.for_each(|(value, noise)| *value += noise);
        }
        network.loaded(&weights).0
    }

    fn config(channels: [usize; 4], blocks_at_32: usize) -> NetworkConfig {
        let shape = CompactConfig {
            channels,
            blocks_at_32,
            ..CompactConfig::default()
        };
        of(Architecture::Compact(shape))
    }

    fn of(architecture: Architecture) -> NetworkConfig {
        NetworkConfig::new(architecture, [200.0, 150.0], &training_camera())
    }

    fn weights(network: Network) -> Weights {
        network.folded().weights
    }

    #[test]
    fn an_unfolded_trunk_is_the_folded_one_up_to_a_factor_and_its_filters_have_length_one() {
        let device = Device::flex();
        let images = Tensor::random([2, 3, 96, 64], Distribution::Uniform(0.0, 1.0), &device);
        let fresh = Network::new(&config([8, 12, 16, 20], 2), &device);
        let trained = noisy(fresh.clone());
        let begun = fresh.clone().with_trunk("w", &weights(trained.clone())).unwrap();
        // New heads have no biases: the logits of their bins tell the features, up to the factor.
        let bins = |network: &Network| {
            let bins = network.as_compact().unwrap().forward(images.clone()).bins;
            Tensor::cat(bins, 1)
        };
        let [ours, theirs] = [&begun, &trained.fold()].map(bins);
        let product = |a: &Tensor<4>, b: &Tensor<4>| (a.clone() * b.clone()).sum().into_scalar::<f32>();
        let factor = product(&ours, &theirs) / product(&theirs, &theirs);
        let size = (product(&ours, &ours) / ours.dims().iter().product::<usize>() as f32).sqrt();
        let off = (ours - theirs * factor).abs().max().into_scalar::<f32>();
        assert!(size > 0.01 && off < 1e-5, "{size} {off}");
        // Other noise than the scale was taken from. Drawn trunks differ between the two by up to 20 %, and without a scale by factors.
        let noise = Tensor::random([1, 3, NOISE_PX, NOISE_PX], Distribution::Uniform(0.0, 1.0), &device);
        let size = begun.as_compact().unwrap().feature_size(noise);
        assert!((size / FEATURE_SIZE - 1.0).abs() < 0.3, "{size}");
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
        let compact = |widest, blocks| Network::new(&config([8, 12, 16, widest], blocks), &device);
        let network = || compact(20, 2);
        let r50f = || Network::new(&of(Architecture::R50F(R50FConfig::narrow(32))), &device);
        let (wider, deeper) = (weights(compact(24, 2)), weights(compact(20, 3)));
        for (network, weights, part) in [
            (network(), Weights::new(), "no main.decode16.first.bias"),
            (network(), weights(r50f()), "no main.decode16.first.bias"),
            (network(), wider, "main.down32.bias has the shape [24]"),
            (network(), deeper, "main.encode32.2."),
            (r50f(), weights(network()), "only a compact network"),
            (network().fold(), weights(network()), "a folded network"),
        ] {
            let error = network.with_trunk("w", &weights).unwrap_err().to_string();
            assert!(error.starts_with("w ") && error.contains(part), "{error}");
        }
    }
}
