//! Images in half precision: what each architecture says then, and the gradients of its weights.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use burn::module::{Module, ModuleVisitor, Param};
use burn::tensor::{DType, Device, Distribution, FloatDType, Gradients, Tensor};
use deepsft::{Architecture, Network, NetworkConfig, PaperConfig, R50FConfig};
use deepsft_geometry::training_camera;

const SIZE_MM: [f64; 2] = [297.0, 210.0];

/// Maps of one image and gradients of all weights of their mean square, flat.
struct Answer {
    maps: Vec<f32>,
    gradients: Vec<f32>,
}

struct Collect<'a> {
    gradients: &'a Gradients,
    values: Vec<f32>,
}

impl ModuleVisitor for Collect<'_> {
    fn visit_float<const D: usize>(&mut self, param: &Param<Tensor<D>>) {
        assert_eq!(param.val().dtype(), DType::F32);
        if let Some(gradient) = param.val().grad(self.gradients) {
            assert_eq!(gradient.dtype(), DType::F32);
            self.values.extend(gradient.into_data().try_to_vec::<f32>().unwrap());
        }
    }
}

fn answer(network: &Network, images: Tensor<4>) -> Answer {
    let maps = network.forward_maps(images);
    let all = [
        maps.main_depth,
        maps.main_registration,
        maps.depth,
        maps.registration,
        maps.mask_logits,
    ];
    for map in &all {
        assert_eq!(map.dtype(), DType::F32);
    }
    let all = Tensor::cat(all.to_vec(), 1);
    let gradients = all.clone().square().mean().backward();
    let mut collect = Collect {
        gradients: &gradients,
        values: Vec::new(),
    };
    network.visit(&mut collect);
    Answer {
        maps: all.into_data().try_to_vec().unwrap(),
        gradients: collect.values,
    }
}

/// Root mean square of a - b over that of a.
fn difference(a: &[f32], b: &[f32]) -> f64 {
    assert_eq!(a.len(), b.len());
    let squares = |values: &mut dyn Iterator<Item = f64>| values.map(|value| value * value).sum::<f64>();
    let off = squares(&mut a.iter().zip(b).map(|(a, b)| f64::from(a - b)));
    (off / squares(&mut a.iter().map(|&a| f64::from(a)))).sqrt()
}

/// Median of |a - b| over the root mean square of a. (The bins of a compact network that has learnt nothing are nearly
/// tied, and planes fitted to its registration mean nothing: rounding changes a few values altogether.)
fn median_difference(a: &[f32], b: &[f32]) -> f64 {
    let mut off: Vec<f32> = a.iter().zip(b).map(|(a, b)| (a - b).abs()).collect();
    off.sort_by(f32::total_cmp);
    let square = a.iter().map(|&a| f64::from(a).powi(2)).sum::<f64>() / a.len() as f64;
    f64::from(off[off.len() / 2]) / square.sqrt()
}

#[test]
fn maps_and_gradients_are_those_of_single_precision_but_for_rounding() {
    let camera = training_camera();
    let device = Device::flex().autodiff();
    let config = |architecture| NetworkConfig::new(architecture, SIZE_MM, &camera);
    for config in [
        NetworkConfig::compact(SIZE_MM, &camera),
        config(Architecture::Paper(PaperConfig::narrow(8))),
        config(Architecture::R50F(R50FConfig::narrow(32))),
    ] {
        let network = config.init(&device);
        let images = Tensor::random([1, 3, 270, 480], Distribution::Uniform(0.0, 1.0), &device);
        let single = answer(&network, images.clone());
        assert!(single.gradients.len() > 1000);
        // Bits of the fraction: 11 and 8.
        for (dtype, bits) in [(FloatDType::F16, 11), (FloatDType::BF16, 8)] {
            let half = answer(&network, images.clone().cast(dtype));
            let maps = median_difference(&single.maps, &half.maps);
            let gradients = difference(&single.gradients, &half.gradients);
            let rounding = 0.5_f64.powi(bits);
            let name = config.architecture.name();
            println!("{name} {dtype:?}: maps {maps:.1e}, gradients {gradients:.1e}, rounding {rounding:.1e}");
            assert!(maps > 0.0 && maps < 8.0 * rounding, "{name} {dtype:?}: maps {maps}");
            assert!(gradients < 40.0 * rounding, "{name} {dtype:?}: gradients {gradients}");
        }
    }
}
