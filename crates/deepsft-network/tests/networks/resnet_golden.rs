//! The paper's network and R50F against an independent program: `tests/golden/golden_resnet.py` writes the same layers
//! down a second time, in numpy and double precision, and wrote the maps beside it, in the environment that
//! `requirements.txt` there locks. Weights and image are one formula of names and indices in both programs.

use burn::module::{Module, ModuleMapper, Param};
use burn::tensor::{Device, Tensor, TensorData};
use deepsft::{Architecture, NetworkConfig, PaperConfig, R50FConfig};
use deepsft_geometry::{Picture, training_camera};
use deepsft_network::{Network, NetworkMaps, OUTSIDE, pictures_to_tensor};
use serde::Deserialize;
use std::collections::BTreeMap;

/// Largest difference in units of the map's deviation: some fifty layers of sums in f32, which differ by 5e-5 at most on
/// the machine that this was written on. A row cropped at the wrong end differs by about one.
const TOLERANCE: f64 = 5e-4;

#[derive(Deserialize)]
struct Golden {
    width_divisor: usize,
    row_step: usize,
    column_step: usize,
    maps: BTreeMap<String, GoldenMap>,
}

#[derive(Deserialize)]
struct GoldenMap {
    mean: f64,
    deviation: f64,
    values: Vec<f64>,
}

/// Numbers of 0..1 that depend on `name` and their index alone: FNV-1a of the name, SplitMix64 of the sum.
fn uniform(name: &str, count: usize) -> impl Iterator<Item = f64> {
    let seed = name.bytes().fold(0xcbf2_9ce4_8422_2325_u64, |hash, byte| {
        (hash ^ u64::from(byte)).wrapping_mul(0x100_0000_01b3)
    });
    (0..count as u64).map(move |index| {
        let z = index.wrapping_add(seed).wrapping_mul(0x9e37_79b9_7f4a_7c15);
        let z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / 2.0_f64.powi(53)
    })
}

fn values(name: &str, count: usize, low: f64, high: f64) -> Vec<f32> {
    uniform(name, count).map(|t| (low + (high - low) * t) as f32).collect()
}

/// Puts the formula's values in the place of a network's weights.
struct Formula(Vec<String>);

impl ModuleMapper for Formula {
    fn enter_module(&mut self, name: &str, _container: &str) {
        self.0.push(name.to_owned());
    }

    fn exit_module(&mut self, _name: &str, _container: &str) {
        self.0.pop();
    }

    fn map_float<const D: usize>(&mut self, param: Param<Tensor<D>>) -> Param<Tensor<D>> {
        let path = self.0.join(".");
        let shape = param.val().dims().to_vec();
        let (low, high) = match (self.0.last().unwrap().as_str(), D) {
            ("weight", _) => {
                // Filters are [out, in, k, k], the weights of dense layers [in, out].
                let fan_in: usize = if D == 4 { shape[1..].iter().product() } else { shape[0] };
                let limit = (3.0 / fan_in as f64).sqrt();
                (-limit, limit)
            }
            ("gamma" | "running_var", _) => (0.5, 1.5),
            ("bias" | "beta" | "running_mean", _) => (-0.1, 0.1),
            (other, _) => panic!("no formula for {other}"),
        };
        param.map(|old| {
            let values = values(&path, shape.iter().product(), low, high);
            Tensor::from_data(TensorData::new(values, shape), &old.device())
        })
    }
}

fn network(architecture: Architecture) -> Network {
    let config = NetworkConfig::new(architecture, [297.0, 210.0], &training_camera());
    Network::new(&config, &Device::flex()).map(&mut Formula(Vec::new()))
}

/// A map's name in the file and where it is found.
type NamedMap = (&'static str, fn(&NetworkMaps) -> &Tensor<4>);

/// Checks `maps` against what numpy computed.
fn compare(golden: &str, architecture: impl Fn(usize) -> Architecture, maps: &[NamedMap]) {
    let golden: Golden = serde_json::from_str(golden).unwrap();
    let network = network(architecture(golden.width_divisor));
    let image = Tensor::from_data(
        TensorData::new(values("image", 3 * 270 * 480, 0.0, 1.0), [1, 3, 270, 480]),
        &Device::flex(),
    );
    assert_eq!(golden.maps.len(), maps.len());
    // With running statistics, and with those folded into the convolutions.
    for said in [network.forward_maps(image.clone()), network.fold().forward_maps(image)] {
        for (name, map) in maps {
            let expected = &golden.maps[*name];
            let actual = map(&said).clone().into_data().try_to_vec::<f32>().unwrap();
            let planes = actual.len() / (270 * 480);
            let mut sampled = Vec::new();
            for plane in 0..planes {
                for y in (golden.row_step / 2..270).step_by(golden.row_step) {
                    for x in (golden.column_step / 2..480).step_by(golden.column_step) {
                        sampled.push(f64::from(actual[(plane * 270 + y) * 480 + x]));
                    }
                }
            }
            assert_eq!(sampled.len(), expected.values.len(), "{name}");
            let mut largest = 0.0_f64;
            for (a, e) in sampled.iter().zip(&expected.values) {
                largest = largest.max((a - e).abs() / expected.deviation);
            }
            let mean = actual.iter().map(|v| f64::from(*v)).sum::<f64>() / actual.len() as f64;
            let off = (mean - expected.mean).abs() / expected.deviation;
            println!("{name}: {largest:e}, mean {off:e}");
            assert!(
                largest < TOLERANCE && off < TOLERANCE,
                "{name} differs by {largest}, its mean by {off}"
            );
        }
    }
}

#[test]
fn the_paper_s_network_says_what_numpy_computes_from_the_same_weights() {
    compare(
        include_str!("../golden/paper.json"),
        |divisor| Architecture::Paper(PaperConfig::narrow(divisor)),
        &[
            ("main_depth", |maps| &maps.main_depth),
            ("main_registration", |maps| &maps.main_registration),
            ("depth", |maps| &maps.depth),
            ("registration", |maps| &maps.registration),
        ],
    );
}

#[test]
fn r50f_says_what_numpy_computes_from_the_same_weights() {
    compare(
        include_str!("../golden/r50f.json"),
        |divisor| Architecture::R50F(R50FConfig::narrow(divisor)),
        &[
            ("depth", |maps| &maps.depth),
            ("registration", |maps| &maps.registration),
        ],
    );
}

/// With the formula's weights R50F says depths around 0, a sixth of them below the threshold halfway to outside.
#[test]
fn maps_read_from_a_network_are_in_millimetres_and_minus_one_outside() {
    let device = Device::flex();
    let network = network(Architecture::R50F(R50FConfig::narrow(16))).fold();
    let picture = Picture::from_fn(480, 270, |x, y| [(x % 251) as u8, (y % 241) as u8, (x * y % 239) as u8]);
    let said = network.forward_maps(pictures_to_tensor(&[&picture], &device));
    let depth = said.depth.into_data().try_to_vec::<f32>().unwrap();
    let registration = said.registration.into_data().try_to_vec::<f32>().unwrap();
    let read = pollster::block_on(network.infer(&picture, None, None, &device)).unwrap();
    let (mut inside, mut outside) = (0, 0);
    for (pixel, &said) in depth.iter().enumerate() {
        if f64::from(said) >= OUTSIDE / 2.0 {
            // The default range: 150 mm at 0, 1200 mm at 1; nothing inside is nearer.
            let mm = (150.0 + 1050.0 * f64::from(said)).max(150.0);
            assert!(read.inside(pixel));
            assert!((f64::from(read.depth()[pixel]) - mm).abs() < 1e-3);
            assert_eq!(
                read.registration()[pixel],
                [registration[pixel], registration[480 * 270 + pixel]]
            );
            inside += 1;
        } else {
            assert_eq!((read.depth()[pixel], read.registration()[pixel]), (-1.0, [-1.0; 2]));
            outside += 1;
        }
    }
    assert!(inside > 10_000 && outside > 10_000, "{inside} {outside}");
}
