//! What the architectures must have in common, and what tells them apart: parameters, sizes, blocks, folding.

use super::{block_parameters, network};
use burn::module::{Module, ModuleMapper, ModuleVisitor, Param};
use burn::tensor::{Device, Distribution, Tensor};
use deepsft::{Architecture, NetworkConfig, PaperConfig, R50FConfig};
use deepsft_geometry::{Picture, training_camera};
use deepsft_network::{Block, Network, NetworkMaps};

const SIZE_MM: [f64; 2] = [297.0, 210.0];

/// Narrow networks of each architecture: widths of 1/16, so that a test takes a part of a second.
fn narrow() -> [NetworkConfig; 3] {
    let camera = training_camera();
    let config = |architecture| NetworkConfig::new(architecture, SIZE_MM, &camera);
    [
        NetworkConfig::compact(SIZE_MM, &camera),
        config(Architecture::Paper(PaperConfig::narrow(16))),
        config(Architecture::R50F(R50FConfig::narrow(16))),
    ]
}

fn image(device: &Device) -> Tensor<4> {
    Tensor::random([1, 3, 270, 480], Distribution::Uniform(0.0, 1.0), device)
}

fn all(maps: &NetworkMaps) -> [(&'static str, &Tensor<4>, usize); 5] {
    [
        ("main depth", &maps.main_depth, 1),
        ("main registration", &maps.main_registration, 2),
        ("depth", &maps.depth, 1),
        ("registration", &maps.registration, 2),
        ("mask", &maps.mask_logits, 1),
    ]
}

/// Sets every running mean and variance, scale and offset to other values, as a training would.
struct Disturb {
    path: Vec<String>,
    seen: usize,
}

impl ModuleMapper for Disturb {
    fn enter_module(&mut self, name: &str, _container: &str) {
        self.path.push(name.to_owned());
    }

    fn exit_module(&mut self, _name: &str, _container: &str) {
        self.path.pop();
    }

    fn map_float<const D: usize>(&mut self, param: Param<Tensor<D>>) -> Param<Tensor<D>> {
        let range = match self.path.last().map(String::as_str) {
            Some("running_mean" | "beta") => Distribution::Uniform(-0.3, 0.3),
            Some("running_var" | "gamma") => Distribution::Uniform(0.5, 2.0),
            _ => return param,
        };
        self.seen += 1;
        param.map(|old| Tensor::random(old.shape(), range, &old.device()))
    }
}

#[test]
fn every_architecture_hands_out_maps_of_the_image_s_size() {
    let device = Device::flex();
    for config in narrow() {
        let network = Network::new(&config, &device).fold();
        let maps = network.forward_maps(image(&device));
        for (name, map, channels) in all(&maps) {
            assert_eq!(
                map.dims(),
                [1, channels, 270, 480],
                "{name} of {}",
                config.architecture.name()
            );
            assert!(map.clone().is_finite().all().into_scalar::<bool>(), "{name}");
        }
    }
}

#[test]
fn folded_networks_say_the_same_as_those_with_running_statistics() {
    let device = Device::flex();
    for config in narrow().into_iter().skip(1) {
        let mut disturb = Disturb {
            path: Vec::new(),
            seen: 0,
        };
        let network = Network::new(&config, &device).map(&mut disturb);
        assert!(disturb.seen >= 4 * 50, "{} values of batch normalisation", disturb.seen);
        let images = image(&device);
        let before = network.forward_maps(images.clone());
        let folded = network.fold();
        let mut names = Names::default();
        folded.visit(&mut names);
        assert!(!names.0.iter().any(|name| name.contains("running")), "{:?}", names.0);
        let after = folded.forward_maps(images);
        for ((name, a, _), (_, b, _)) in all(&before).into_iter().zip(all(&after)) {
            let size = a.clone().abs().max().into_scalar::<f32>();
            let off = (a.clone() - b.clone()).abs().max().into_scalar::<f32>();
            // The same sums in another order of f32 through some fifty layers.
            assert!(
                off < 1e-3 * size.max(1.0),
                "{name} of {}: {off} of {size}",
                config.architecture.name()
            );
        }
    }
}

#[derive(Default)]
struct Names(Vec<String>);

impl ModuleVisitor for Names {
    fn enter_module(&mut self, name: &str, _container: &str) {
        self.0.push(name.to_owned());
    }
}

/// Weights that get a gradient of `loss`, by the first part of their path.
fn trained(network: &Network, loss: Tensor<1>) -> std::collections::BTreeMap<String, bool> {
    struct Visit<'a> {
        path: Vec<String>,
        gradients: &'a burn::tensor::Gradients,
        found: std::collections::BTreeMap<String, bool>,
    }
    impl ModuleVisitor for Visit<'_> {
        fn enter_module(&mut self, name: &str, _container: &str) {
            self.path.push(name.to_owned());
        }
        fn exit_module(&mut self, _name: &str, _container: &str) {
            self.path.pop();
        }
        fn visit_float<const D: usize>(&mut self, param: &Param<Tensor<D>>) {
            if self.path.iter().any(|name| name.starts_with("running")) {
                return;
            }
            let has = param.val().grad(self.gradients).is_some();
            let all = self.found.entry(self.path[0].clone()).or_insert(has);
            assert_eq!(
                *all,
                has,
                "{}: some weights of a part are trained, others are not",
                self.path.join(".")
            );
        }
    }
    let gradients = loss.backward();
    let mut visit = Visit {
        path: Vec::new(),
        gradients: &gradients,
        found: Default::default(),
    };
    network.visit(&mut visit);
    visit.found
}

#[test]
fn only_the_chosen_blocks_get_gradients_and_all_of_their_weights_do() {
    let device = Device::flex().autodiff();
    for config in narrow() {
        let sum = |network: &Network| {
            let maps = network.forward_maps(image(&device));
            all(&maps)
                .into_iter()
                .map(|(_, map, _)| map.clone().square().mean())
                .reduce(|a, b| a + b)
                .unwrap()
        };
        let network = Network::new(&config, &device);
        let everything = trained(&network, sum(&network));
        assert!(everything.values().all(|&t| t), "{everything:?}");
        if matches!(network, Network::R50F(_)) {
            continue;
        }
        for (block, part) in [
            (Block::DepthRefinement, "depth_refinement"),
            (Block::RegistrationRefinement, "registration_refinement"),
        ] {
            let network = Network::new(&config, &device).train_only(&[block]);
            for (name, is_trained) in trained(&network, sum(&network)) {
                assert_eq!(is_trained, name == part, "{name}");
            }
        }
    }
}

#[test]
fn frozen_blocks_keep_their_running_statistics_and_trained_ones_move_them() {
    struct Means(Vec<(String, f32)>, Vec<String>);
    impl ModuleVisitor for Means {
        fn enter_module(&mut self, name: &str, _container: &str) {
            self.1.push(name.to_owned());
        }
        fn exit_module(&mut self, _name: &str, _container: &str) {
            self.1.pop();
        }
        fn visit_float<const D: usize>(&mut self, param: &Param<Tensor<D>>) {
            if self.1.last().is_some_and(|name| name == "running_mean") {
                self.0
                    .push((self.1[0].clone(), param.val().abs().sum().into_scalar::<f32>()));
            }
        }
    }
    let device = Device::flex().autodiff();
    let [_, config, _] = narrow();
    let network = Network::new(&config, &device).train_only(&[Block::DepthRefinement]);
    network.forward_maps(image(&device));
    let mut means = Means(Vec::new(), Vec::new());
    network.valid().visit(&mut means);
    assert!(means.0.len() > 50);
    for (part, moved) in means.0 {
        assert_eq!(moved > 0.0, part == "depth_refinement", "{part}: {moved}");
    }
}

#[test]
fn parameters_are_those_that_the_paper_s_counts_and_keras_tell() {
    let paper = network(Architecture::Paper(PaperConfig::default()));
    // Printed in the paper: 13,618,689 for a refinement block with one output; a second output is another filter of
    // 3 x 3 x 64 with bias. The main block is 250 below the printed 81,664,765.
    assert_eq!(block_parameters(&paper, Block::DepthRefinement), 13_618_689);
    assert_eq!(
        block_parameters(&paper, Block::RegistrationRefinement),
        13_618_689 + 577
    );
    assert_eq!(block_parameters(&paper, Block::Main), 81_664_515);
    assert_eq!(paper.num_params(), 81_664_515 + 2 * 13_618_689 + 577);
    drop(paper);
    let r50f = network(Architecture::R50F(R50FConfig::default()));
    // Keras' ResNet-50 without its top, 9 x 15 x 2048 values to 200 neurons, those to 3 x 270 x 480 values.
    let dense = (9 * 15 * 2048 + 1) * 200 + (200 + 1) * 3 * 270 * 480;
    assert_eq!(r50f.num_params(), 23_587_712 + dense);
    assert_eq!(block_parameters(&r50f, Block::Main), r50f.num_params());
    assert_eq!(block_parameters(&r50f, Block::DepthRefinement), 0);
}

/// Glorot and Bengio's uniform distribution over -l..l has a variance of l^2 / 3 = 2 / (fan-in + fan-out).
#[test]
fn weights_are_drawn_as_glorot_and_bengio_say() {
    let camera = training_camera();
    let network = NetworkConfig::new(Architecture::Paper(PaperConfig::narrow(4)), SIZE_MM, &camera);
    let arrays = Network::new(&network, &Device::flex()).weights();
    let filters = &arrays["main.decode5.first.spatial.weight"];
    assert_eq!(filters.shape, [256, 256, 3, 3]);
    let variance = filters.values.iter().map(|w| f64::from(*w).powi(2)).sum::<f64>() / filters.values.len() as f64;
    let expected = 2.0 / (9.0 * (256.0 + 256.0));
    // 589,824 values: the variance's own deviation is 0.1 %.
    assert!((variance / expected - 1.0).abs() < 0.01, "{variance} {expected}");
    let largest = filters.values.iter().fold(0.0_f32, |m, w| m.max(w.abs()));
    assert!(f64::from(largest) <= (3.0 * expected).sqrt() && f64::from(largest) > 0.99 * (3.0 * expected).sqrt());
}

#[test]
fn maps_at_given_pixels_are_the_network_s_own_there_and_nothing_elsewhere() {
    let device = Device::flex();
    device.seed(3);
    let picture = Picture::from_fn(480, 270, |x, y| [(x / 2) as u8, (y % 256) as u8, ((x * y) % 251) as u8]);
    for config in narrow() {
        let network = Network::new(&config, &device).fold();
        let own = pollster::block_on(network.infer(&picture, None, None, &device)).unwrap();
        // Stripes: half of what the network sees, and half of what it does not.
        let seen: Vec<bool> = (0..480 * 270).map(|pixel| pixel / 480 % 2 == 0).collect();
        let maps = pollster::block_on(network.infer(&picture, Some(&seen), None, &device)).unwrap();
        assert_eq!(maps.mask(), seen, "{}", config.architecture.name());
        for pixel in (0..seen.len()).filter(|&pixel| seen[pixel] && own.inside(pixel)) {
            assert_eq!(maps.depth()[pixel], own.depth()[pixel]);
            assert_eq!(maps.registration()[pixel], own.registration()[pixel]);
        }
        assert!(pollster::block_on(network.infer(&picture, Some(&seen[1..]), None, &device)).is_err());
    }
}
