//! A network as plain arrays: `network.json` names them and says where each lies in `arrays.f32`.

use super::workload::{self, compact_network};
use crate::reading;
use anyhow::{Result, anyhow};
use burn::tensor::Tensor;
use deepsft::{DeviceKind, ModelBundle, NetworkConfig, encode_png};
use deepsft_formats::{FolderKind, write_folder};
use deepsft_geometry::Picture;
use deepsft_network::{CompactNetwork, images_to_tensor, start_device};
use serde::Serialize;
use std::collections::BTreeMap;
use std::path::Path;

const DESCRIPTION: &str = "network.json";

const KIND: FolderKind = FolderKind {
    known_by: &[DESCRIPTION],
    files: &[DESCRIPTION, VALUES, FRAME, "clip-#.png"],
};
const VALUES: &str = "arrays.f32";
const FRAME: &str = "frame.png";

#[derive(Serialize)]
struct Description<'a> {
    config: &'a NetworkConfig,
    weights: Vec<Entry>,
    inputs: Vec<Entry>,
    outputs: Vec<Entry>,
}

/// An array, row-major; `offset` counts values.
#[derive(Serialize)]
struct Entry {
    name: String,
    shape: Vec<usize>,
    offset: usize,
}

/// Writes the bundle's network, the camera frame `image`, the network's input for it and all that comes out, and the
/// frames of the clip that the mesh is followed through.
pub fn write(bundle: &ModelBundle, image: &Picture, folder: &Path) -> Result<()> {
    let estimator = reading::estimator(bundle)?;
    let (device, _) = pollster::block_on(start_device(DeviceKind::Cpu))?;
    let canonical = estimator.canonical_image(image, &workload::camera(bundle)?)?;
    let images = images_to_tensor(&[&canonical], &device);
    let output = compact_network(bundle, &device)?.forward(images.clone());
    let pixels = CompactNetwork::at_pixels(output.refined.clone());
    let outputs = [
        ("bins.0", output.bins[0].clone()),
        ("bins.1", output.bins[1].clone()),
        ("bins.2", output.bins[2].clone()),
        ("main", output.main),
        ("refined", output.refined),
        ("pixels", pixels),
        ("mask", output.mask),
    ];
    let network = bundle.network();
    let mut values = Vec::new();
    let weights = network.weights.iter();
    let weights = weights.map(|(name, array)| Entry::add(&mut values, name, array.shape.clone(), &array.values));
    let description = Description {
        config: &network.config,
        weights: weights.collect(),
        inputs: vec![Entry::of_tensor(&mut values, "images", images)?],
        outputs: (outputs.into_iter())
            .map(|(name, tensor)| Entry::of_tensor(&mut values, name, tensor))
            .collect::<Result<_>>()?,
    };
    let mut files = BTreeMap::from([
        (FRAME.to_owned(), encode_png(image)?),
        (DESCRIPTION.to_owned(), serde_json::to_vec_pretty(&description)?),
    ]);
    for (k, picture) in workload::clip(bundle)?.iter().enumerate() {
        files.insert(format!("clip-{k:02}.png"), encode_png(picture)?);
    }
    let values = values.iter().flat_map(|value| value.to_le_bytes()).collect();
    files.insert(VALUES.to_owned(), values);
    write_folder(folder, &KIND, &files)?;
    println!("{} weights: {}", network.parameters(), folder.display());
    Ok(())
}

impl Entry {
    /// Adds an array to `all`.
    fn add(all: &mut Vec<f32>, name: &str, shape: Vec<usize>, values: &[f32]) -> Self {
        let offset = all.len();
        all.extend(values);
        Self {
            name: name.to_owned(),
            shape,
            offset,
        }
    }

    fn of_tensor(all: &mut Vec<f32>, name: &str, tensor: Tensor<4>) -> Result<Self> {
        let shape = tensor.dims().to_vec();
        let read = tensor.into_data().try_to_vec::<f32>();
        let read = read.map_err(|error| anyhow!("reading {name}: {error:?}"))?;
        Ok(Self::add(all, name, shape, &read))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn arrays_lie_one_after_the_other_and_offsets_count_values() {
        let mut values = Vec::new();
        let first = Entry::add(&mut values, "a", vec![2, 3], &[0.0; 6]);
        let second = Entry::add(&mut values, "b", vec![1], &[7.0]);
        assert_eq!((first.offset, second.offset), (0, 6));
        assert_eq!(values[second.offset], 7.0);
    }
}
