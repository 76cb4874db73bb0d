//! The gradients of the loss against central differences, in double precision.

use crate::data::BatchTensors;
use crate::loss::{
    DepthLoss, Light, PhotoConsistencyLoss, Residual, TexturePyramid, squared_total_variation, step_one_loss,
    supervised_maps_loss,
};
use burn::tensor::{DType, Device, Tensor, TensorData};
use deepsft::DepthRange;
use deepsft_geometry::Picture;
use deepsft_network::{NetworkMaps, NetworkOutput};

/// Step of the central differences: their error is about step^2 times a third derivative of order
/// one, and rounding divided by the step: both below 1e-9.
const STEP: f64 = 1e-5;
const TOLERANCE: f64 = 1e-6;

/// Pseudo-random values in -scale..scale that stay clear of zero, where |x| has a kink.
fn values(count: usize, scale: f64, seed: u64) -> Vec<f64> {
    let mut state = seed;
    (0..count)
        .map(|_| {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            let unit = (state >> 11) as f64 / (1_u64 << 53) as f64;
            let sign = if state & (1 << 7) == 0 { 1.0 } else { -1.0 };
            sign * scale * (0.1 + 0.9 * unit)
        })
        .collect()
}

fn tensor(values: &[f64], shape: [usize; 4], device: &Device) -> Tensor<4> {
    Tensor::from_data(TensorData::new(values.to_vec(), shape), (device, DType::F64))
}

/// Checks the gradient of `value`, a function of one map of `shape`, at `at` in every `stride`-th entry; gives the
/// largest met. `tolerance` is absolute.
fn check(
    at: &[f64],
    shape: [usize; 4],
    stride: usize,
    tolerance: f64,
    value: impl Fn(Tensor<4>, &Device) -> Tensor<1>,
) -> f64 {
    let device = Device::flex();
    let tracked = Device::flex().autodiff();
    let leaf = tensor(at, shape, &tracked).require_grad();
    let gradients = value(leaf.clone(), &tracked).backward();
    let gradient = leaf.grad(&gradients).unwrap().into_data().try_to_vec::<f64>().unwrap();
    let mut largest = 0.0_f64;
    for i in (0..gradient.len()).step_by(stride) {
        let moved = |step: f64| {
            let mut moved = at.to_vec();
            moved[i] += step;
            value(tensor(&moved, shape, &device), &device).into_scalar::<f64>()
        };
        let numeric = (moved(STEP) - moved(-STEP)) / (2.0 * STEP);
        assert!(
            (gradient[i] - numeric).abs() < tolerance,
            "entry {i}: {} and {numeric}",
            gradient[i]
        );
        largest = largest.max(gradient[i].abs());
    }
    largest
}

const MAP: [usize; 4] = [2, 1, 6, 8];

/// A mask of holes.
fn mask(shape: [usize; 4], seed: u64) -> Vec<f64> {
    let drawn = values(count(shape), 1.0, seed);
    drawn.iter().map(|v| f64::from(*v > -0.6)).collect()
}

#[test]
fn the_gradient_of_total_variation_agrees_with_central_differences() {
    let largest = check(&values(count(MAP), 1.0, 21), MAP, 1, TOLERANCE, |maps, device| {
        squared_total_variation(maps, tensor(&mask(MAP, 22), MAP, device))
    });
    assert!(largest > 1.0, "{largest}");
}

#[test]
fn the_gradient_of_the_loss_of_step_two_agrees_with_central_differences() {
    let loss = DepthLoss {
        total_variation: 0.01,
        unit_mm: Some(500.0),
    };
    let measured = values(count(MAP), 1.0, 24);
    let largest = check(&values(count(MAP), 1.0, 23), MAP, 1, TOLERANCE, |depth, device| {
        let counts = tensor(&mask(MAP, 25), MAP, device);
        let outside = tensor(&mask(MAP, 26), MAP, device);
        let measured = tensor(&measured, MAP, device);
        loss.apply(depth, measured, counts, Some(outside), DepthRange::default())
    });
    assert!(largest > 0.01, "{largest}");
}

const REGISTRATION: [usize; 4] = [2, 2, 6, 8];

/// Registrations that run over the template, a third of a texel (of level 0) away from every kink of the warp at least.
fn registration() -> Vec<f64> {
    let [n, _, h, w] = REGISTRATION;
    let one = |image: usize, k: usize, i: usize| {
        let (x, y) = ((i % w) as f64, (i / w) as f64);
        // Texel positions 0.5 + whole + 0.35: kinks are at 0.5 + whole.
        let texel = if k == 0 { x + image as f64 } else { y };
        (texel.floor() + 0.5 + 0.35 + 0.02 * y) / TEXELS[k]
    };
    (0..n)
        .flat_map(|image| (0..2).flat_map(move |k| (0..h * w).map(move |i| one(image, k, i))))
        .collect()
}

const TEXELS: [f64; 2] = [12.0, 8.0];

fn texture(device: &Device) -> TexturePyramid {
    let picture = Picture::from_fn(TEXELS[0] as usize, TEXELS[1] as usize, |x, y| {
        [
            (40 + 13 * x + 3 * y) as u8,
            (200 - 11 * y - x) as u8,
            (60 + (x * y) % 90) as u8,
        ]
    });
    TexturePyramid::new(&picture, device).cast(DType::F64)
}

#[test]
fn the_gradient_of_the_warp_goes_through_its_weights() {
    let weights = values(3 * 48, 1.0, 26);
    let shape = [1, 2, 6, 8];
    let at = &registration()[..96];
    let largest = check(at, shape, 1, 1e-5, |registration, device| {
        (texture(device).warp(0, registration) * tensor(&weights, [1, 3, 6, 8], device)).sum()
    });
    assert!(largest > 10.0, "{largest}");
}

#[test]
fn beyond_the_texture_the_warp_is_constant() {
    let device = Device::flex().autodiff();
    // In every pixel one coordinate is outside; the other one may move.
    let outside = tensor(&[-0.2, 1.3, 0.4, 0.6, 0.3, 0.7, -0.1, 1.4], [1, 2, 1, 4], &device).require_grad();
    let gradients = texture(&device).warp(0, outside.clone()).sum().backward();
    let gradient = outside
        .grad(&gradients)
        .unwrap()
        .into_data()
        .try_to_vec::<f64>()
        .unwrap();
    assert_eq!([gradient[0], gradient[1], gradient[6], gradient[7]], [0.0; 4]);
    assert!(gradient[2].abs() > 1.0 && gradient[4].abs() > 1.0, "{gradient:?}");
}

#[test]
fn the_gradient_of_the_loss_of_step_three_agrees_with_central_differences() {
    let images: Vec<f64> = values(2 * 3 * 48, 0.2, 27).iter().map(|v| 0.5 + v).collect();
    let pixels = [2, 1, 6, 8];
    for (residual, half_size, cauchy_scale) in [(Residual::Squared, 0.5, 4.0), (Residual::Plain, 0.7, 20.0)] {
        let loss = PhotoConsistencyLoss {
            cauchy_scale,
            residual,
            half_size,
            total_variation: 0.01,
            light: Light::Ignored,
        };
        // Values of the loss are about 100, gradients per unit of u some 10: rounding is 1e-9 here, the third
        // derivative of chi of the squared difference is steep.
        let largest = check(&registration(), REGISTRATION, 1, 1e-4, |registration, device| {
            let images = tensor(&images, [2, 3, 6, 8], device);
            let inside = tensor(&mask(pixels, 28), pixels, device);
            loss.apply(registration, &images, &inside, &texture(device), &[0, 1])
        });
        assert!(largest > 0.1, "{largest}");
    }
}

const CELLS: [usize; 4] = [1, 3, 2, 4];
const PIXELS: [usize; 4] = [1, 1, 16, 32];
const BINS: [usize; 4] = [1, 5, 1, 2];

fn count(shape: [usize; 4]) -> usize {
    shape.iter().product()
}

/// What the network could have said: refined, main, mask and three sets of bins, one after another.
fn parts() -> Vec<(Vec<f64>, [usize; 4])> {
    let mut parts = vec![
        (values(count(CELLS), 0.05, 1), CELLS),
        (values(count(CELLS), 0.05, 2), CELLS),
        (values(count(PIXELS), 3.0, 3), PIXELS),
    ];
    parts.extend((4..7).map(|seed| (values(count(BINS), 2.0, seed), BINS)));
    parts
}

fn batch(device: &Device) -> BatchTensors {
    let positive = |shape, seed| {
        values(count(shape), 1.0, seed)
            .iter()
            .map(|v| v.abs())
            .collect::<Vec<_>>()
    };
    let soft = |seed| {
        let raw = tensor(&positive(BINS, seed), BINS, device);
        raw.clone() / raw.sum_dim(1)
    };
    let mask: Vec<f64> = values(count(PIXELS), 1.0, 11)
        .iter()
        .map(|v| f64::from(*v > 0.0))
        .collect();
    BatchTensors {
        images: Tensor::zeros([1, 3, 16, 32], device),
        corners: Tensor::zeros([1, 2, 1, 1], device),
        mask: tensor(&mask, PIXELS, device),
        // Targets of 0 keep the errors where `values` put them: on both sides of the smooth L1's bend at 0.01.
        cells: Tensor::zeros(CELLS, (device, DType::F64)),
        cell_weight: tensor(&positive([1, 1, 2, 4], 12), [1, 1, 2, 4], device),
        bin_targets: vec![soft(13), soft(14), soft(15)],
        bin_weight: tensor(&positive([1, 1, 1, 2], 16), [1, 1, 1, 2], device),
    }
}

fn output(tensors: &[Tensor<4>]) -> NetworkOutput {
    NetworkOutput {
        refined: tensors[0].clone(),
        main: tensors[1].clone(),
        mask: tensors[2].clone(),
        bins: vec![tensors[3].clone(), tensors[4].clone(), tensors[5].clone()],
    }
}

#[test]
fn the_gradient_of_every_term_of_the_loss_agrees_with_central_differences() {
    let device = Device::flex();
    let tracked = device.clone().autodiff();
    let parts = parts();
    let leaves: Vec<Tensor<4>> = parts
        .iter()
        .map(|(v, s)| tensor(v, *s, &tracked).require_grad())
        .collect();
    let loss = step_one_loss(output(&leaves), &batch(&tracked));
    let gradients = loss.backward();

    let value = |parts: &[(Vec<f64>, [usize; 4])]| {
        let tensors: Vec<Tensor<4>> = parts.iter().map(|(v, s)| tensor(v, *s, &device)).collect();
        step_one_loss(output(&tensors), &batch(&device)).into_scalar::<f64>()
    };
    let mut largest = 0.0_f64;
    for (part, leaf) in leaves.iter().enumerate() {
        let gradient = leaf.grad(&gradients).unwrap().into_data().try_to_vec::<f64>().unwrap();
        for i in (0..gradient.len()).step_by(3) {
            let moved = |step: f64| {
                let mut moved = parts.clone();
                moved[part].0[i] += step;
                value(&moved)
            };
            let numeric = (moved(STEP) - moved(-STEP)) / (2.0 * STEP);
            assert!(
                (gradient[i] - numeric).abs() < TOLERANCE,
                "part {part}, entry {i}: {} and {numeric}",
                gradient[i]
            );
            largest = largest.max(gradient[i].abs());
        }
    }
    assert!(largest > 0.01, "the test must see gradients, the largest is {largest}");
}

/// The step-1 loss of the architectures that say full-resolution maps.
#[test]
fn the_gradient_of_the_loss_on_maps_agrees_with_central_differences() {
    const DEPTH: [usize; 4] = [2, 1, 3, 4];
    const REGISTRATION: [usize; 4] = [2, 2, 3, 4];
    let device = Device::flex();
    let tracked = device.clone().autodiff();
    let shapes = [DEPTH, REGISTRATION, DEPTH, REGISTRATION];
    let parts: Vec<Vec<f64>> = (0..4).map(|k| values(count(shapes[k]), 1.0, 21 + k as u64)).collect();
    let loss = |said: &[Tensor<4>], device: &Device| {
        let maps = NetworkMaps {
            main_depth: said[0].clone(),
            main_registration: said[1].clone(),
            depth: said[2].clone(),
            registration: said[3].clone(),
            mask_logits: said[2].clone(),
        };
        let depth = tensor(&values(count(DEPTH), 1.0, 31), DEPTH, device);
        let registration = tensor(&values(count(REGISTRATION), 1.0, 32), REGISTRATION, device);
        supervised_maps_loss(&maps, &depth, &registration)
    };
    let leaves: Vec<Tensor<4>> = (0..4)
        .map(|k| tensor(&parts[k], shapes[k], &tracked).require_grad())
        .collect();
    let gradients = loss(&leaves, &tracked).backward();
    for part in 0..4 {
        let gradient = leaves[part]
            .grad(&gradients)
            .unwrap()
            .into_data()
            .try_to_vec::<f64>()
            .unwrap();
        for i in 0..gradient.len() {
            let moved = |step: f64| {
                let mut moved = parts.clone();
                moved[part][i] += step;
                let said: Vec<Tensor<4>> = (0..4).map(|k| tensor(&moved[k], shapes[k], &device)).collect();
                loss(&said, &device).into_scalar::<f64>()
            };
            let numeric = (moved(STEP) - moved(-STEP)) / (2.0 * STEP);
            assert!(
                (gradient[i] - numeric).abs() < TOLERANCE,
                "part {part}, entry {i}: {} and {numeric}",
                gradient[i]
            );
        }
        assert!(gradient.iter().any(|g| g.abs() > 0.01), "part {part} has no influence");
    }
}
