//! The executor says what burn's own path says.

use burn::module::{Module, ModuleMapper, Param};
use burn::tensor::{Device, Tensor, TensorData};
use deepsft::{
    Architecture, CompactConfig, DeviceKind, MODEL_FILE, ModelBundle, NetworkConfig, PaperConfig, R50FConfig, Stage,
};
use deepsft_geometry::glam::DVec3;
use deepsft_geometry::{GeometryError, ImageSize, Maps, Picture, RestSurface, Template, training_camera};
use deepsft_inference::{Executor, FoldedNetwork};
use deepsft_network::{CompactNetwork, Network, images_to_tensor, pictures_to_tensor, start_device};
use std::path::Path;

/// Something with edges, waves and flat parts.
fn picture(width: usize, height: usize, seed: usize) -> Picture {
    Picture::from_fn(width, height, |x, y| {
        let wave = ((x * x + 3 * y * y + seed * x * y) as f64 / 9000.0).sin();
        let tile = ((x / 23 + y / 17 + seed) * 2_654_435_761) >> 7;
        match (x / 80 + y / 60) % 3 {
            0 => [(128.0 + 120.0 * wave) as u8; 3],
            1 => [tile as u8, (tile >> 8) as u8, (tile >> 4) as u8],
            _ => [200, 190, 170],
        }
    })
}

/// Draws weights, the same for the same number, some times as large as keeps most of a signal's size.
struct Drawn(u64, f32);

impl ModuleMapper for Drawn {
    fn map_float<const D: usize>(&mut self, param: Param<Tensor<D>>) -> Param<Tensor<D>> {
        param.map(|weights| {
            let shape = weights.dims();
            let count: usize = shape.iter().product();
            let size = if D == 1 {
                0.1
            } else {
                (count as f32 / shape[0] as f32).sqrt().recip()
            };
            let next = |_| {
                self.0 = self
                    .0
                    .wrapping_mul(6_364_136_223_846_793_005)
                    .wrapping_add(1_442_695_040_888_963_407);
                ((self.0 >> 40) as f32 / (1 << 23) as f32 - 1.0) * size * self.1
            };
            let values: Vec<f32> = (0..count).map(next).collect();
            Tensor::from_data(TensorData::new(values, shape), &weights.device())
        })
    }
}

/// A folded network that nothing was taught.
fn drawn(architecture: Architecture, seed: u64) -> Network {
    let (device, _) = pollster::block_on(start_device(DeviceKind::Cpu)).unwrap();
    let config = NetworkConfig::new(architecture, [200.0, 150.0], &training_camera());
    let gain = if config.as_compact().is_some() { 1.0 } else { 2.0 };
    Network::new(&config, &device).fold().map(&mut Drawn(seed, gain))
}

fn compact_executor(network: &Network, image: &Picture) -> Executor {
    let FoldedNetwork { config, weights } = network.folded();
    Executor::new(&config, image.size(), &weights, 2).unwrap()
}

/// The largest differences: in the coordinates of the main block and after refinement, and in the mask's logits.
fn differences(network: &Network, image: &Picture) -> [f32; 3] {
    let (device, _) = pollster::block_on(start_device(DeviceKind::Cpu)).unwrap();
    let compact: &CompactNetwork = network.as_compact().unwrap();
    let expected = compact.forward(images_to_tensor(&[image], &device));
    let mut executor = compact_executor(network, image);
    // Twice: nothing of the first image may be left.
    executor.run(&picture(image.width(), image.height(), 99)).unwrap();
    executor.run(image).unwrap();
    let cells = [
        (Stage::Main, expected.main.clone()),
        (Stage::RegistrationRefinement, expected.refined.clone()),
    ];
    let [main, refined] = cells.map(|(stage, tensor)| {
        let ours = executor.cells(stage).unwrap().concat();
        let theirs = tensor.into_data().try_to_vec::<f32>().unwrap();
        assert_eq!(ours.len(), theirs.len());
        let off = ours.iter().zip(&theirs).map(|(a, b)| (a - b).abs());
        off.fold(0.0, f32::max)
    });
    let columns = expected.mask.dims()[3];
    let mask = expected.mask.into_data().try_to_vec::<f32>().unwrap();
    let pixels = (0..image.height()).flat_map(|y| (0..image.width()).map(move |x| (x, y)));
    let logits = pixels.map(|(x, y)| (executor.mask_logit(x, y).unwrap() - mask[y * columns + x]).abs());
    [main, refined, logits.fold(0.0, f32::max)]
}

fn shipped(name: &str) -> Network {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../models").join(name);
    let read = |name: String| (name.clone(), std::fs::read(folder.join(name)).unwrap());
    let listed = ModelBundle::file_names(&std::fs::read(folder.join(MODEL_FILE)).unwrap()).unwrap();
    let names = listed.into_iter().map(|(name, _)| name);
    let files = names.chain([MODEL_FILE.to_owned()]).map(read).collect();
    let bundle = ModelBundle::from_files(&files).unwrap();
    let (device, _) = pollster::block_on(start_device(DeviceKind::Cpu)).unwrap();
    Network::from_folded(bundle.network(), &device).unwrap()
}

#[test]
fn the_shipped_model_says_the_same_to_a_ten_thousandth() {
    let network = shipped("poster-a4");
    for seed in 0..3 {
        let [main, refined, logits] = differences(&network, &picture(480, 270, seed));
        assert!(
            main < 1e-4 && refined < 1e-4 && logits < 1e-3,
            "{main} {refined} {logits}"
        );
    }
}

#[test]
fn networks_of_other_widths_and_sizes_and_of_rest_positions_say_the_same() {
    let shape = |channels, blocks_at_32, bins: &[usize]| CompactConfig {
        channels,
        blocks_at_32,
        bins: bins.to_vec(),
        refinement_channels: 20,
        mask_channels: 9,
    };
    for (shape, [width, height]) in [
        (shape([5, 12, 37, 50], 1, &[7, 33, 12]), [200, 130]),
        (shape([16, 48, 33, 18], 0, &[7, 33, 12, 9]), [96, 64]),
        (shape([40, 16, 80, 16], 3, &[7, 33, 12, 40]), [481, 271]),
    ] {
        let [main, refined, logits] = differences(&drawn(Architecture::Compact(shape), 1), &picture(width, height, 5));
        // What is no surface has no planes: measuring them multiplies rounding errors.
        assert!(
            main < 1e-4 && refined < 5e-3 && logits < 1e-3,
            "{main} {refined} {logits}"
        );
    }
}

/// A surface on which rest positions are looked up: a sheet, on which what is nearest does not jump.
fn rest_surface() -> RestSurface {
    let picture = Picture::from_fn(2, 2, |_, _| [0; 3]);
    RestSurface::new(&Template::thin_shell(picture, 200.0, 150.0).unwrap())
}

/// How far maps of the compact network may be apart: registration, and depth, an exponential, over the range or itself.
const COMPACT: [f64; 2] = [2e-4, 2e-3];

/// The maps of a stage by burn.
fn expected(network: &Network, image: &Picture, stage: Stage, seen: Option<&[bool]>, device: &Device) -> Maps {
    if stage == Stage::RegistrationRefinement {
        return pollster::block_on(network.infer(image, seen, Some(&rest_surface()), device)).unwrap();
    }
    let values = |tensor: Tensor<4>| tensor.into_data().try_to_vec::<f32>().unwrap();
    let said = network.forward_maps(pictures_to_tensor(&[image], device));
    let depth = if stage == Stage::Main {
        said.main_depth
    } else {
        said.depth
    };
    let [depth, uv, logits] = [depth, said.main_registration, said.mask_logits].map(values);
    let (range, pixels, surface) = (network.config().depth_range, depth.len(), rest_surface());
    let registration = |pixel: usize| {
        let at = |k: usize| uv[k * pixels + pixel];
        match network.config().has_rest_positions() {
            true => surface
                .registration(DVec3::new(at(0).into(), at(1).into(), at(2).into()))
                .unwrap()
                .as_vec2()
                .to_array(),
            false => [at(0), at(1)],
        }
    };
    let mut maps = Maps::empty(image.size());
    for pixel in 0..pixels {
        let in_mask = if network.says_outside() {
            depth[pixel] >= -0.5
        } else {
            logits[pixel] >= 0.0
        };
        if seen.map_or(in_mask, |seen| seen[pixel]) {
            let near = if network.says_outside() { range.near_mm } else { 0.0 };
            let mm = range.depth_mm_linear(f64::from(depth[pixel])).max(near);
            maps.set(pixel, mm as f32, registration(pixel));
        }
    }
    maps
}

/// Compares the maps of all stages, at all pixels and in the mask.
fn compare_maps(network: &Network, image: &Picture, [max_off, max_apart]: [f64; 2]) {
    let (device, _) = pollster::block_on(start_device(DeviceKind::Cpu)).unwrap();
    let (size @ ImageSize { width, height }, span) = (image.size(), network.config().depth_range.span_mm());
    let mut executor = network.folded().executor(size).unwrap();
    executor.run(image).unwrap();
    let all = vec![true; width * height];
    for seen in [None, Some(&all[..])] {
        for &stage in network.config().architecture.stages() {
            let expected = expected(network, image, stage, seen, &device);
            let mut maps = Maps::empty((width, height));
            executor.read(stage, seen, Some(&rest_surface()), &mut maps).unwrap();
            let mut outvoted = 0;
            for pixel in 0..width * height {
                if maps.inside(pixel) != expected.inside(pixel) {
                    outvoted += 1;
                } else if maps.inside(pixel) {
                    let off = (maps.uv(pixel) - expected.uv(pixel)).length();
                    let (ours, theirs) = (maps.depth()[pixel], expected.depth()[pixel]);
                    let apart = f64::from((ours - theirs).abs()) / span.max(theirs.into());
                    assert!(off < max_off && apart < max_apart, "{stage:?} {pixel}: {off} {apart}");
                }
            }
            // Where the logit is nothing but rounding.
            assert!(outvoted < 10, "{stage:?}: {outvoted}");
        }
    }
}

#[test]
fn maps_at_pixels_are_those_of_the_network() {
    let network = shipped("poster-a4");
    compare_maps(&network, &picture(480, 270, 1), COMPACT);
    let mut executor = network.folded().executor((480, 270)).unwrap();
    assert!(executor.run(&picture(470, 270, 1)).is_err());
    assert!(
        executor
            .read(Stage::Main, None, None, &mut Maps::empty((3, 3)))
            .is_err()
    );
}

#[test]
fn rest_positions_at_pixels_are_looked_up_as_the_network_does() {
    let shape = CompactConfig {
        channels: [8, 12, 16, 20],
        bins: vec![40, 30, 10, 20],
        ..CompactConfig::default()
    };
    let network = drawn(Architecture::Compact(shape), 3);
    compare_maps(&network, &picture(96, 64, 2), COMPACT);
    let mut executor = network.folded().executor((96, 64)).unwrap();
    let read = executor.read(Stage::Main, None, None, &mut Maps::empty((96, 64)));
    assert_eq!(read, Err(GeometryError::NoRestSurface));
}

#[test]
fn the_papers_network_and_r50f_say_the_same_to_a_ten_thousandth() {
    for architecture in [
        Architecture::Paper(PaperConfig::narrow(16)),
        Architecture::R50F(R50FConfig::narrow(16)),
    ] {
        let network = drawn(architecture, 1);
        let image = picture(480, 270, 4);
        compare_maps(&network, &image, [1e-4, 1e-4]);
        let mut executor = network.folded().executor((480, 270)).unwrap();
        executor.run(&image).unwrap();
        let mut maps = Maps::empty((480, 270));
        executor
            .read(Stage::Main, Some(&[true; 480 * 270]), None, &mut maps)
            .unwrap();
        let us = || (0..480 * 270).map(|pixel| maps.uv(pixel).x);
        let (least, most) = (us().fold(f64::MAX, f64::min), us().fold(f64::MIN, f64::max));
        assert!(most - least > 0.05, "{least} to {most}: nothing is compared");
    }
}
