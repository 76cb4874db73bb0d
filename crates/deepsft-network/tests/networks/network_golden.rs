//! The network against an independent program: the same weights and image through an ONNX graph that was written from
//! the network's description, in ONNX Runtime. `golden.py` wrote the files beside it in `tests/golden`,
//! in the environment that `requirements.txt` there locks.

use burn::module::{Module, ModuleMapper, Param};
use burn::tensor::{Device, Tensor, TensorData};
use deepsft::NetworkConfig;
use deepsft_network::{CompactNetwork, Network};
use serde::Deserialize;
use std::collections::BTreeMap;

/// Largest difference of any value: two orders of summing at most 99 products of the order of 1 in f32, through
/// some twenty layers.
const TOLERANCE: f32 = 5e-5;

#[derive(Deserialize)]
struct Description {
    config: NetworkConfig,
    weights: Vec<Entry>,
    inputs: Vec<Entry>,
    outputs: Vec<Entry>,
}

#[derive(Deserialize)]
struct Entry {
    name: String,
    shape: Vec<usize>,
    offset: usize,
}

/// Arrays by name.
struct Arrays(BTreeMap<String, (Vec<usize>, Vec<f32>)>);

impl Arrays {
    fn read(entries: &[Entry], values: &[f32]) -> Self {
        let array = |Entry { name, shape, offset }: &Entry| {
            let count: usize = shape.iter().product();
            (name.clone(), (shape.clone(), values[*offset..offset + count].to_vec()))
        };
        Self(entries.iter().map(array).collect())
    }
}

/// Puts arrays in the place of a network's weights, each exactly once.
struct Load {
    arrays: Arrays,
    path: Vec<String>,
}

impl ModuleMapper for Load {
    fn enter_module(&mut self, name: &str, _container: &str) {
        self.path.push(name.to_owned());
    }

    fn exit_module(&mut self, _name: &str, _container: &str) {
        self.path.pop();
    }

    fn map_float<const D: usize>(&mut self, param: Param<Tensor<D>>) -> Param<Tensor<D>> {
        let name = self.path.join(".");
        let (shape, values) = self.arrays.0.remove(&name).unwrap_or_else(|| panic!("no array {name}"));
        param.map(|old| {
            assert_eq!(old.dims().to_vec(), shape, "{name}");
            Tensor::from_data(TensorData::new(values, shape), &old.device())
        })
    }
}

/// The golden network, its image [1, 3, H, W] and the expected outputs by name.
fn golden() -> (Network, Tensor<4>, Arrays) {
    let description: Description = serde_json::from_str(include_str!("../golden/network.json")).unwrap();
    let bytes = include_bytes!("../golden/arrays.f32");
    let values: Vec<f32> = bytes
        .as_chunks()
        .0
        .iter()
        .map(|&chunk| f32::from_le_bytes(chunk))
        .collect();
    let arrays = |entries: &[Entry]| Arrays::read(entries, &values);
    let device = Device::flex();
    let mut load = Load {
        arrays: arrays(&description.weights),
        path: Vec::new(),
    };
    let network = Network::new(&description.config, &device).fold().map(&mut load);
    assert!(load.arrays.0.is_empty(), "weights that the network does not have");
    let (shape, image) = arrays(&description.inputs).0.remove("images").unwrap();
    let image = Tensor::from_data(TensorData::new(image, shape), &device);
    (network, image, arrays(&description.outputs))
}

#[test]
fn every_output_is_what_onnx_runtime_computes_from_the_same_weights() {
    let (network, image, expected) = golden();
    let output = network.as_compact().unwrap().forward(image);
    let pixels = CompactNetwork::at_pixels(output.refined.clone());
    let actual = [
        ("bins.0", output.bins[0].clone()),
        ("bins.1", output.bins[1].clone()),
        ("bins.2", output.bins[2].clone()),
        ("main", output.main),
        ("refined", output.refined),
        ("pixels", pixels),
        ("mask", output.mask),
    ];
    assert_eq!(expected.0.len(), actual.len());
    for (name, tensor) in actual {
        let (shape, expected) = &expected.0[name];
        assert_eq!(&tensor.dims().to_vec(), shape, "{name}");
        let actual = tensor.into_data().try_to_vec::<f32>().unwrap();
        let largest = actual
            .iter()
            .zip(expected)
            .map(|(a, e)| (a - e).abs())
            .fold(0.0, f32::max);
        println!("{name}: {largest:e}");
        assert!(largest <= TOLERANCE, "{name} differs by {largest}");
    }
}

#[test]
fn weights_are_handed_out_under_the_names_and_in_the_shapes_the_other_program_uses() {
    let (network, _, _) = golden();
    let description: Description = serde_json::from_str(include_str!("../golden/network.json")).unwrap();
    let expected: BTreeMap<_, _> = description
        .weights
        .iter()
        .map(|e| (e.name.as_str(), &e.shape))
        .collect();
    let weights = network.weights();
    let actual: BTreeMap<_, _> = weights
        .iter()
        .map(|(name, array)| (name.as_str(), &array.shape))
        .collect();
    assert_eq!(actual, expected);
    let values: usize = weights.values().map(|array| array.values.len()).sum();
    assert_eq!(values, network.num_params());
}
