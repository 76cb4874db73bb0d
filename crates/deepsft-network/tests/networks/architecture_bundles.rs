//! Model bundles of every architecture: written in 8 bits, read back, refused when they do not fit.

use burn::tensor::{Device, Distribution, Tensor};
use deepsft::{
    Accuracy, Architecture, CompactConfig, Estimator, FoundRule, MODEL_FILE, ModelBundle, ModelCard, NetworkConfig,
    PaperConfig, Provenance, R50FConfig,
};
use deepsft_geometry::{Picture, Template, training_camera};
use deepsft_network::Network;
use std::collections::BTreeMap;

type Files = BTreeMap<String, Vec<u8>>;

const SIZE_MM: [f64; 2] = [60.0, 40.0];
const WEIGHTS_FILE: &str = "weights.bpk";

fn template() -> Template {
    Template::thin_shell(
        Picture::from_fn(30, 20, |x, y| [x as u8, y as u8, 9]),
        SIZE_MM[0],
        SIZE_MM[1],
    )
    .unwrap()
}

fn bundle(architecture: Architecture) -> ModelBundle {
    let camera = training_camera();
    let network = Network::new(&NetworkConfig::new(architecture, SIZE_MM, &camera), &Device::flex());
    let card = ModelCard {
        name: "narrow".to_owned(),
        licence: Some("MIT OR Apache-2.0".to_owned()),
        found: FoundRule::default(),
        provenance: Provenance::default(),
        accuracy: Accuracy::default(),
    };
    ModelBundle::new(network.folded(), template(), camera, card)
}

fn narrow_paper() -> Architecture {
    Architecture::Paper(PaperConfig::narrow(32))
}

fn narrow_r50f() -> Architecture {
    Architecture::R50F(R50FConfig::narrow(32))
}

fn refusal(files: &Files) -> String {
    ModelBundle::from_files(files).unwrap_err().to_string()
}

fn edit(files: &Files, from: &str, to: &str) -> Files {
    let json = String::from_utf8(files[MODEL_FILE].clone()).unwrap();
    assert!(json.contains(from), "{from} in {json}");
    let mut files = files.clone();
    files.insert(MODEL_FILE.to_owned(), json.replacen(from, to, 1).into_bytes());
    files
}

#[test]
fn every_architecture_comes_back_and_says_the_same_but_for_its_rounding() {
    let device = Device::flex();
    let images = Tensor::random([1, 3, 270, 480], Distribution::Uniform(0.0, 1.0), &device);
    for architecture in [
        Architecture::Compact(CompactConfig::default()),
        narrow_paper(),
        narrow_r50f(),
    ] {
        let said = |bundle: &ModelBundle| {
            let network = Network::from_folded(bundle.network(), &device).unwrap();
            network.forward_maps(images.clone()).registration
        };
        // Of narrow networks some are drawn that say nothing.
        let drawn = (0..20).map(|_| bundle(architecture.clone()));
        let mut said_by = drawn.map(|bundle| (said(&bundle), bundle));
        let (before, original) = said_by
            .find(|(said, _)| said.clone().abs().max().into_scalar::<f32>() > 0.0)
            .unwrap();
        let files = original.to_files().unwrap();
        let read = ModelBundle::from_files(&files).unwrap();
        assert_eq!(read.network().config, original.network().config);
        assert_eq!(read.network().parameters(), original.network().parameters());
        // Rounding twice changes nothing.
        assert_eq!(read.to_files().unwrap(), files);
        let parameters = original.network().parameters();
        // A byte per weight, two per bias, four per filter (narrow dense layers have many of few weights), and names and
        // alignment of each array.
        let (arrays, bytes) = (original.network().weights.len(), files[WEIGHTS_FILE].len());
        let most = parameters + parameters / 4 + 2048 * arrays;
        assert!((parameters..most).contains(&bytes), "{parameters} {bytes}");
        let after = said(&read);
        let size = before.clone().abs().max().into_scalar::<f32>();
        let off = (before - after).abs().mean().into_scalar::<f32>();
        // A filter's weights move by up to 2^-8 of its largest one; layers add up. The mean, since in an untrained compact
        // network two bins may be equally likely somewhere, and the other one wins.
        assert!(off > 0.0 && off < 0.03 * size, "{off} of {size}");
        let estimator = Estimator::new(&read, &deepsft::Device::Cpu).unwrap();
        let image = Picture::from_fn(480, 270, |x, y| [x as u8, y as u8, 128]);
        let maps = pollster::block_on(estimator.infer(&image, read.camera()));
        assert_eq!(maps.unwrap().size().width, 480);
    }
}

#[test]
fn weights_of_another_architecture_or_width_are_refused_by_the_file_s_name() {
    let (paper, r50f) = (
        bundle(narrow_paper()).to_files().unwrap(),
        bundle(narrow_r50f()).to_files().unwrap(),
    );
    let mut mixed = paper.clone();
    mixed.insert(WEIGHTS_FILE.to_owned(), r50f[WEIGHTS_FILE].clone());
    // Another file than the listed one: refused before anything is made of it.
    assert!(refusal(&mixed).starts_with("weights.bpk"), "{}", refusal(&mixed));
    for (from, to) in [
        (r#""width_divisor": 32"#, r#""width_divisor": 16"#),
        (
            r#""architecture": "paper""#,
            r#""architecture": "r50f", "neurons": 200"#,
        ),
    ] {
        let refusal = refusal(&edit(&paper, from, to));
        assert!(
            refusal.starts_with("weights.bpk of the model bundle cannot be used"),
            "{refusal}"
        );
    }
}

#[test]
fn descriptions_that_no_network_can_be_made_of_are_refused_and_say_why() {
    let paper = bundle(narrow_paper()).to_files().unwrap();
    for (from, to, reason) in [
        (
            r#""architecture": "paper""#,
            r#""architecture": "vgg""#,
            "unknown variant `vgg`",
        ),
        (r#""architecture": "paper","#, "", "missing field `architecture`"),
        (
            r#""width_divisor": 32"#,
            r#""width_divisor": 0"#,
            "width_divisor is 0, expected 1 to 64",
        ),
        (
            r#""momentum": 0.1"#,
            r#""momentum": 1.5"#,
            "momentum is 1.5, expected 0 to 1",
        ),
    ] {
        let refusal = refusal(&edit(&paper, from, to));
        assert!(
            refusal.starts_with("model.json of the model bundle cannot be used"),
            "{refusal}"
        );
        assert!(refusal.contains(reason), "{refusal}");
    }
}
