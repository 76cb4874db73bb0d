//! Model bundles: written, read back, and refused when a file is not as published.

use burn::tensor::Device;
use burn_pack::{Bytes, DType, Reader, Tensor as Packed, Writer};
use deepsft::{
    Accuracy, FoundRule, MODEL_FILE, ModelBundle, ModelCard, NetworkConfig, Provenance, WeightArray, Weights,
    weights_from_burnpack, weights_to_burnpack,
};
use deepsft_formats::sha256;
use deepsft_geometry::{Picture, Template, training_camera};
use deepsft_network::Network;
use std::collections::BTreeMap;

type Files = BTreeMap<String, Vec<u8>>;

const WEIGHTS_FILE: &str = "weights.bpk";

fn files() -> Files {
    let network = Network::new(
        &NetworkConfig::compact([297.0, 210.0], &training_camera()),
        &Device::flex(),
    );
    let template = Template::thin_shell(Picture::from_fn(30, 21, |x, y| [x as u8, y as u8, 7]), 297.0, 210.0).unwrap();
    let card = ModelCard {
        name: "test".to_owned(),
        licence: Some("MIT OR Apache-2.0".to_owned()),
        found: FoundRule::default(),
        provenance: Provenance::default(),
        accuracy: Accuracy::default(),
    };
    ModelBundle::new(network.folded(), template, training_camera(), card)
        .to_files()
        .unwrap()
}

fn refusal(files: &Files) -> String {
    ModelBundle::from_files(files).unwrap_err().to_string()
}

fn edit(files: &mut Files, from: &str, to: &str) {
    let json = String::from_utf8(files[MODEL_FILE].clone()).unwrap();
    assert!(json.contains(from), "{from} in {json}");
    files.insert(MODEL_FILE.to_owned(), json.replacen(from, to, 1).into_bytes());
}

fn describe(files: &mut Files, description: &str) {
    files.insert(MODEL_FILE.to_owned(), description.as_bytes().to_vec());
}

#[test]
fn a_bundle_comes_back_with_its_weights_rounded() {
    let files = files();
    let bundle = ModelBundle::from_files(&files).unwrap();
    assert_eq!(bundle.name(), "test");
    assert_eq!(bundle.camera(), &training_camera());
    // Rounding twice changes nothing: the same files come out.
    assert_eq!(bundle.to_files().unwrap(), files);
    assert_eq!(bundle.card().licence.as_deref(), Some("MIT OR Apache-2.0"));
}

#[test]
fn a_bundle_need_not_state_a_licence() {
    let mut files = files();
    edit(&mut files, "  \"licence\": \"MIT OR Apache-2.0\",\n", "");
    let bundle = ModelBundle::from_files(&files).unwrap();
    assert_eq!(bundle.card().licence, None);
    assert_eq!(bundle.to_files().unwrap(), files);
}

#[test]
fn the_template_is_read_without_the_weights_and_checked_all_the_same() {
    let mut files = files();
    files.remove(WEIGHTS_FILE);
    let (template, camera) = ModelBundle::template_from_files(&files).unwrap();
    assert_eq!(template.size_mm().x, 297.0);
    assert_eq!(camera, training_camera());
    files.get_mut("template/texture.png").unwrap()[60] ^= 1;
    let refusal = ModelBundle::template_from_files(&files).unwrap_err().to_string();
    assert!(
        refusal.starts_with("template/texture.png of the model bundle is not"),
        "{refusal}"
    );
}

#[test]
fn what_is_missing_cut_altered_newer_or_does_not_fit_is_refused_and_named() {
    type Edit = fn(&mut Files);
    let cases: [(Edit, &str); 7] = [
        (
            |files| drop(files.remove(WEIGHTS_FILE)),
            "model bundle lacks weights.bpk",
        ),
        (
            |files| files.get_mut(WEIGHTS_FILE).unwrap().truncate(1000),
            "weights.bpk of the model bundle has 1000 bytes",
        ),
        (
            |files| files.get_mut(WEIGHTS_FILE).unwrap()[5000] ^= 1,
            "weights.bpk of the model bundle is not the file that was published",
        ),
        (
            // It is called newer even if the rest is unknown.
            |files| describe(files, r#"{"format_version": 2, "something": "else"}"#),
            "model bundle has format version 2, this program reads version 1",
        ),
        (
            |files| describe(files, "<!doctype html>"),
            "model.json of the model bundle cannot be used",
        ),
        (
            |files| edit(files, "\"blocks_at_32\": 2", "\"blocks_at_32\": 3"),
            "weights.bpk of the model bundle cannot be used",
        ),
        (
            // Before a network of this size is made.
            |files| edit(files, "\"blocks_at_32\": 2", "\"blocks_at_32\": 200000000"),
            "model.json of the model bundle cannot be used: blocks_at_32",
        ),
    ];
    let published = files();
    for (edit, expected) in cases {
        let mut files = published.clone();
        edit(&mut files);
        let refusal = refusal(&files);
        assert!(refusal.starts_with(expected), "{refusal}");
    }
}

#[test]
fn filters_are_rounded_to_steps_of_their_own_and_biases_to_half_precision() {
    let array = |shape: &[usize], values: &[f32]| WeightArray {
        shape: shape.to_vec(),
        values: values.to_vec(),
    };
    let filters = array(&[3, 2, 1, 1], &[1.0, -0.303, 250.0, 7.3, 0.0, 0.0]);
    let weights = Weights::from([
        ("a.bias".to_owned(), array(&[2], &[0.100_01, -2.0])),
        ("a.weight".to_owned(), filters.clone()),
    ]);
    let file = weights_to_burnpack(&weights).unwrap();
    let read = weights_from_burnpack(&file).unwrap();
    assert_eq!(read.keys().collect::<Vec<_>>(), ["a.bias", "a.weight"]);
    assert_eq!(read["a.bias"].values[1], -2.0);
    assert!((read["a.bias"].values[0] - 0.1).abs() < 1e-4);
    assert_eq!(read["a.weight"].shape, filters.shape);
    for (k, (before, after)) in filters.values.iter().zip(&read["a.weight"].values).enumerate() {
        let largest = [1.0, 250.0, 0.0][k / 2];
        assert!((before - after).abs() <= largest / 127.0 * 0.501, "{before} {after}");
    }
    assert_ne!(read["a.weight"].values[1], -0.303);
    assert_eq!(weights_to_burnpack(&read).unwrap(), file);

    let spoilt = Weights::from([("a.weight".to_owned(), array(&[1, 1], &[f32::INFINITY]))]);
    assert!(
        weights_to_burnpack(&spoilt)
            .unwrap_err()
            .to_string()
            .starts_with("a.weight")
    );
    let bytes = |bytes: &[u8]| Bytes::from_bytes_vec(bytes.to_vec());
    let integers = || Packed::new("a.weight".to_owned(), DType::I8, vec![2, 1], None, bytes(&[1, 2]));
    let steps = Packed::new("a.weight.step".to_owned(), DType::F32, vec![1], None, bytes(&[0; 4]));
    for tensors in [vec![integers()], vec![integers(), steps]] {
        let file = Writer::new(tensors).into_bytes().unwrap();
        let refusal = weights_from_burnpack(&file).unwrap_err().to_string();
        assert!(refusal.contains("without 2 steps a.weight.step"), "{refusal}");
    }
}

#[test]
fn weights_whose_shape_no_number_counts_are_refused() {
    // Of quantised values the reader of the container does not check that the shape fits the bytes.
    let kind = DType::QFloat(burn::tensor::quantization::QuantScheme::default());
    let bytes = Bytes::from_bytes_vec(vec![0; 4]);
    let tensor = Packed::new("a.weight".to_owned(), kind, vec![usize::MAX / 2, 3], None, bytes);
    let file = Writer::new(vec![tensor]).into_bytes().unwrap();
    let refusal = weights_from_burnpack(&file).unwrap_err();
    assert!(refusal.to_string().contains("a.weight holds QFloat"), "{refusal}");
}

#[test]
fn weights_of_another_kind_are_refused() {
    let mut files = files();
    let reader = Reader::from_bytes(Bytes::from_bytes_vec(files[WEIGHTS_FILE].clone())).unwrap();
    let mut spoilt = String::new();
    let packed = reader
        .into_tensors()
        .unwrap()
        .into_iter()
        .enumerate()
        .map(|(number, tensor)| {
            let (name, kind, shape, id, bytes) = tensor.into_parts().unwrap();
            if number > 0 {
                return Packed::new(name, kind, shape, id, bytes);
            }
            spoilt = name.clone();
            let numbers = Bytes::from_bytes_vec(vec![0; shape.num_elements()]);
            Packed::new(name, DType::U8, shape, id, numbers)
        });
    let weights = Writer::new(packed.collect()).into_bytes().unwrap().to_vec();
    let old = files[WEIGHTS_FILE].clone();
    edit(&mut files, &sha256(&old), &sha256(&weights));
    let size = |bytes: &[u8]| format!("\"size\": {}", bytes.len());
    edit(&mut files, &size(&old), &size(&weights));
    files.insert(WEIGHTS_FILE.to_owned(), weights);
    let refusal = refusal(&files);
    assert!(refusal.contains(&spoilt) && refusal.contains("U8"), "{refusal}");
}

#[test]
fn a_network_for_another_template_or_camera_is_refused() {
    for (from, to, parts) in [
        ("297.0,", "298.0,", ["template_size_mm", "298 x 210"]),
        ("\"focal\": 380.0", "\"focal\": 381.0", ["focal is 381", "380"]),
        ("240.0,", "250.0,", ["principal_point is (250, 135)", "(240, 135)"]),
    ] {
        let mut files = files();
        edit(&mut files, from, to);
        // Who only fits meshes is not to be misled either.
        let template_only = ModelBundle::template_from_files(&files).unwrap_err().to_string();
        assert_eq!(refusal(&files), template_only);
        assert!(parts.iter().all(|part| template_only.contains(part)), "{template_only}");
    }
}
