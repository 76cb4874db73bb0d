//! The operation beside burn's own, by its values and by finite differences.

use super::{Convolved, by_burn, convolve, on_processor};
use burn::tensor::{DType, Device, Tensor, TensorData};

type Convolve = fn(Tensor<4>, Tensor<4>, Tensor<1>, Convolved) -> Tensor<4>;

/// Of the largest number: Winograd's method rounds at 5e-6, a wrong border or filter is off by a tenth at least.
const TOLERANCE: f32 = 1e-4;

/// Samples, channels in and out, rows, columns.
type Size = [usize; 5];

/// Numbers of -1..1 that depend on their places alone.
fn numbers<const D: usize>(seed: usize, shape: [usize; D], device: &Device) -> Tensor<D> {
    let count = shape.iter().product();
    let number = |i: usize| ((i * 7919 + seed * 104_729 + i * i * 31) % 2003) as f32 / 1001.0 - 1.0;
    let numbers = (0..count).map(number).collect::<Vec<_>>();
    Tensor::from_data(TensorData::new(numbers, shape), (device, DType::F32))
}

fn values<const D: usize>(tensor: Tensor<D>) -> Vec<f32> {
    tensor.into_data().try_to_vec().unwrap()
}

fn inputs(
    [samples, inputs, outputs, rows, columns]: Size,
    kernel: usize,
    device: &Device,
) -> (Tensor<4>, Tensor<4>, Tensor<1>) {
    (
        numbers(1, [samples, inputs, rows, columns], device),
        numbers(2, [outputs, inputs, kernel, kernel], device),
        numbers(3, [outputs], device),
    )
}

/// The output and the gradients of maps, weights and biases of its sum, weighed.
fn worked_out(size: Size, kernel: usize, how: Convolved, convolve: Convolve) -> [Vec<f32>; 4] {
    let (x, weight, bias) = inputs(size, kernel, &Device::flex().autodiff());
    let (x, weight, bias) = (x.require_grad(), weight.require_grad(), bias.require_grad());
    let y = convolve(x.clone(), weight.clone(), bias.clone(), how);
    let along = numbers(4, y.dims(), &y.device());
    let gradients = (y.clone() * along).sum().backward();
    [
        values(y),
        values(x.grad(&gradients).unwrap()),
        values(weight.grad(&gradients).unwrap()),
        values(bias.grad(&gradients).unwrap()),
    ]
}

#[test]
fn output_and_gradients_are_burns_for_every_kind_of_convolution() {
    let sizes = [
        [3, 5, 7, 6, 5],
        [2, 16, 32, 8, 12],
        [1, 23, 40, 9, 10],
        [5, 3, 4, 4, 4],
        [2, 3, 2, 1, 3],
        [17, 33, 17, 5, 8],
    ];
    for size in sizes {
        for (kernel, stride, rectified) in [
            (1, 1, None),
            (1, 2, Some(1.5)),
            (3, 1, None),
            (3, 1, Some(1.7)),
            (3, 2, None),
            (3, 2, Some(0.5)),
            (5, 3, None),
            (7, 2, Some(1.0)),
        ] {
            let how = Convolved { stride, rectified };
            let (x, weight, bias) = inputs(size, kernel, &Device::flex().autodiff());
            assert!(on_processor(&x, &weight, &bias, how).is_some());
            let ours = worked_out(size, kernel, how, convolve);
            let burns = worked_out(size, kernel, how, by_burn);
            for (name, (ours, burns)) in ["output", "maps", "weights", "biases"]
                .into_iter()
                .zip(ours.iter().zip(&burns))
            {
                let largest = burns.iter().fold(0.0_f32, |most, number| most.max(number.abs()));
                assert_eq!(ours.len(), burns.len());
                let apart = ours
                    .iter()
                    .zip(burns)
                    .fold(0.0_f32, |most, (a, b)| most.max((a - b).abs()));
                assert!(
                    apart <= TOLERANCE * largest,
                    "{size:?} {kernel} x {kernel} {how:?}: {name} {apart} apart of {largest}"
                );
            }
        }
    }
}

#[test]
fn the_gradients_are_what_central_differences_say() {
    // Linear in each of the three where nothing is rectified, so that a wide step has no error but rounding.
    let (size, how) = (
        [2, 6, 10, 7, 9],
        Convolved {
            stride: 1,
            rectified: None,
        },
    );
    let [_, of_x, of_weight, of_bias] = worked_out(size, 3, how, convolve);
    let device = Device::flex();
    let (x, weight, bias) = inputs(size, 3, &device);
    let (dx, dweight, dbias) = (
        numbers(5, x.dims(), &device),
        numbers(6, weight.dims(), &device),
        numbers(7, bias.dims(), &device),
    );
    let loss = |step: [f32; 3]| {
        let y = convolve(
            x.clone() + dx.clone() * step[0],
            weight.clone() + dweight.clone() * step[1],
            bias.clone() + dbias.clone() * step[2],
            how,
        );
        let along = numbers(4, y.dims(), &device);
        (y * along).sum().into_scalar::<f32>()
    };
    let dot = |gradient: &[f32], along: Vec<f32>| gradient.iter().zip(along).map(|(a, b)| a * b).sum::<f32>();
    let slopes = [
        dot(&of_x, values(dx.clone())),
        dot(&of_weight, values(dweight.clone())),
        dot(&of_bias, values(dbias.clone())),
    ];
    for (k, slope) in slopes.into_iter().enumerate() {
        let step = |by: f32| std::array::from_fn(|at| if at == k { by } else { 0.0 });
        let numeric = loss(step(0.5)) - loss(step(-0.5));
        assert!(
            (slope - numeric).abs() < 1e-3 * slopes.iter().fold(1.0, |most, slope| slope.abs().max(most)),
            "{k}: {slope} and {numeric}"
        );
    }
}

#[test]
fn results_are_the_same_bit_for_bit_for_any_number_of_threads() {
    let of_threads = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            [1, 2].map(|stride| {
                worked_out(
                    [5, 40, 24, 9, 12],
                    3,
                    Convolved {
                        stride,
                        rectified: None,
                    },
                    convolve,
                )
            })
        })
    };
    let alone = of_threads(1);
    for threads in [2, 3, 5] {
        assert!(of_threads(threads) == alone, "{threads} threads");
    }
}
