//! The gradients of the loss against central differences, in double precision.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use burn::tensor::{DType, Device, Tensor, TensorData};
use deepsft::NetworkOutput;
use deepsft_train::{BatchTensors, LossWeights, step_one_loss};

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
        bin_targets: [soft(13), soft(14), soft(15)],
        bin_weight: tensor(&positive([1, 1, 1, 2], 16), [1, 1, 1, 2], device),
    }
}

fn output(tensors: &[Tensor<4>]) -> NetworkOutput {
    NetworkOutput {
        refined: tensors[0].clone(),
        main: tensors[1].clone(),
        mask: tensors[2].clone(),
        bins: [tensors[3].clone(), tensors[4].clone(), tensors[5].clone()],
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
    let loss = step_one_loss(output(&leaves), &batch(&tracked), &LossWeights::default());
    let gradients = loss.total.backward();

    let value = |parts: &[(Vec<f64>, [usize; 4])]| {
        let tensors: Vec<Tensor<4>> = parts.iter().map(|(v, s)| tensor(v, *s, &device)).collect();
        step_one_loss(output(&tensors), &batch(&device), &LossWeights::default())
            .total
            .into_scalar::<f64>()
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
