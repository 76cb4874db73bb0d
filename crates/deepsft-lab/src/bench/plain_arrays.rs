//! A network as plain arrays: `network.json` names them and says where each lies in `arrays.f32`.

use super::workload::{self, compact_network};
use crate::reading;
use anyhow::{Result, anyhow};
use deepsft::{DeviceKind, FoldedNetwork, ModelBundle, NetworkConfig, encode_png};
use deepsft_formats::{FolderKind, write_folder};
use deepsft_geometry::Picture;
use deepsft_network::{CompactNetwork, images_to_tensor, start_device};
use serde::Serialize;
use std::collections::BTreeMap;
use std::path::Path;

const DESCRIPTION: &str = "network.json";

/// The folder.
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

/// The arrays one after the other.
#[derive(Default)]
struct Values(Vec<f32>);

impl Values {
    fn add(&mut self, name: impl Into<String>, shape: Vec<usize>, values: &[f32]) -> Entry {
        let offset = self.0.len();
        self.0.extend(values);
        Entry {
            name: name.into(),
            shape,
            offset,
        }
    }
}

/// Writes the bundle's network, the camera frame `image`, the network's input for it and all that comes out, and the
/// frames of the clip that the mesh is followed through.
pub fn write(bundle: &ModelBundle, image: &Picture, folder: &Path) -> Result<()> {
    let estimator = reading::estimator(bundle)?;
    let (device, _) = pollster::block_on(start_device(DeviceKind::Cpu))?;
    let canonical = estimator.canonical_image(image, &workload::camera(bundle)?)?;
    let images = images_to_tensor(&[&canonical], &device);
    let output = compact_network(bundle, &device)?.forward(images.clone());
    let [u, v, d] = output.bins;
    let pixels = CompactNetwork::at_pixels(output.refined.clone());
    let tensors = [
        ("images", images),
        ("bins.0", u),
        ("bins.1", v),
        ("bins.2", d),
        ("main", output.main),
        ("refined", output.refined),
        ("pixels", pixels),
        ("mask", output.mask),
    ];
    let mut arrays = Vec::new();
    for (name, tensor) in tensors {
        let shape = tensor.dims().to_vec();
        let read = tensor
            .into_data()
            .try_to_vec::<f32>()
            .map_err(|error| anyhow!("reading {name}: {error:?}"))?;
        arrays.push((name, shape, read));
    }
    let mut files = BTreeMap::from([(FRAME.to_owned(), encode_png(image)?)]);
    for (k, picture) in workload::clip(bundle)?.iter().enumerate() {
        files.insert(format!("clip-{k:02}.png"), encode_png(picture)?);
    }
    write_network(bundle.network(), &arrays, files, folder)
}

/// Writes a network, `arrays` (its input, then what comes out) and `files`.
pub fn write_network(
    network: &FoldedNetwork,
    arrays: &[(&str, Vec<usize>, Vec<f32>)],
    mut files: BTreeMap<String, Vec<u8>>,
    folder: &Path,
) -> Result<()> {
    let mut values = Values::default();
    let weights = network.weights.iter();
    let weights = weights
        .map(|(name, array)| values.add(name.clone(), array.shape.clone(), &array.values))
        .collect();
    let mut inputs: Vec<Entry> = (arrays.iter())
        .map(|(name, shape, array)| values.add(*name, shape.clone(), array))
        .collect();
    let outputs = inputs.split_off(1);
    let description = Description {
        config: &network.config,
        weights,
        inputs,
        outputs,
    };
    files.insert(DESCRIPTION.to_owned(), serde_json::to_vec_pretty(&description)?);
    let values = values.0.iter().flat_map(|value| value.to_le_bytes()).collect();
    files.insert(VALUES.to_owned(), values);
    write_folder(folder, &KIND, &files)?;
    println!(
        "{} weights in {} arrays: {}",
        network.parameters(),
        description.weights.len(),
        folder.display()
    );
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn arrays_lie_one_after_the_other_and_offsets_count_values() {
        let mut values = Values::default();
        let first = values.add("a", vec![2, 3], &[0.0; 6]);
        let second = values.add("b", vec![1], &[7.0]);
        assert_eq!((first.offset, second.offset), (0, 6));
        assert_eq!(values.0[second.offset], 7.0);
    }
}
