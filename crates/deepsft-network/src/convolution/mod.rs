//! Convolutions that are trained: in single precision on the processor by [`batch`], which burn's graph differentiates through
//! the operation below; elsewhere burn's own.

mod batch;
mod gradient_kernel;
mod padded_maps;
mod scratch;
#[cfg(test)]
#[path = "../../tests/inside/convolution.rs"]
mod tests;
mod winograd;

use batch::Convolving;
use burn::backend::autodiff::checkpoint::{base::Checkpointer, strategy::NoCheckpointing};
use burn::backend::autodiff::grads::Gradients;
use burn::backend::autodiff::ops::{Backward, Ops, OpsKind};
use burn::backend::flex::FlexTensor;
use burn::backend::{Autodiff, Flex};
use burn::tensor::{DType, Slice, Tensor, TensorData, activation, module::conv2d, ops::ConvOptions};
use padded_maps::PaddedMaps;
use std::sync::Arc;

/// What a convolution does, beside its weights.
#[derive(Clone, Copy, Debug)]
pub struct Convolved {
    /// Step between the places that are worked out.
    pub stride: usize,
    /// What is read: negative numbers as zero, the others times this; `None` for all as they are.
    pub rectified: Option<f32>,
}

/// [N, in, H, W] -> [N, out, ceil(H / stride), ceil(W / stride)] with weights [out, in, k, k], k odd, and biases [out] of the
/// same precision; zeros are around the maps.
pub fn convolve(x: Tensor<4>, weight: Tensor<4>, bias: Tensor<1>, how: Convolved) -> Tensor<4> {
    on_processor(&x, &weight, &bias, how).unwrap_or_else(|| by_burn(x, weight, bias, how))
}

fn by_burn(x: Tensor<4>, weight: Tensor<4>, bias: Tensor<1>, how: Convolved) -> Tensor<4> {
    let Convolved { stride, rectified } = how;
    let x = match rectified {
        Some(gain) => activation::relu(x) * gain,
        None => x,
    };
    let [outputs, inputs, kernel, _] = weight.dims();
    if kernel == 1 {
        // A 1x1 convolution is a matrix product; its gradients are matrix products too.
        let x = every(x, stride);
        let [n, _, h, w] = x.dims();
        let flat: Tensor<3> = x.reshape([n, inputs, h * w]);
        let weight: Tensor<3> = weight.reshape([1, outputs, inputs]);
        let bias: Tensor<3> = bias.reshape([1, outputs, 1]);
        return (weight.matmul(flat) + bias).reshape([n, outputs, h, w]);
    }
    let pad = kernel / 2;
    conv2d(
        x,
        weight,
        Some(bias),
        ConvOptions::new([stride; 2], [pad; 2], [1; 2], 1),
    )
}

/// Every `stride`-th row and column, from the first: [N, C, H, W] -> [N, C, ceil(H / stride), ceil(W / stride)].
fn every(x: Tensor<4>, stride: usize) -> Tensor<4> {
    if stride == 1 {
        return x;
    }
    let stepped = Slice::with_step(0, None, stride as isize);
    x.slice([Slice::full(), Slice::full(), stepped, stepped])
}

/// `None` for tensors that are elsewhere or in another precision.
fn on_processor(x: &Tensor<4>, weight: &Tensor<4>, bias: &Tensor<1>, how: Convolved) -> Option<Tensor<4>> {
    if x.dtype() != DType::F32 {
        return None;
    }
    let [_, inputs, height, width] = x.dims();
    let [outputs, _, kernel, _] = weight.dims();
    let mut convolving = Convolving {
        inputs,
        outputs,
        kernel,
        stride: how.stride,
        size: [height, width],
        rectified: how.rectified,
        by_definition: false,
    };
    if let Ok(x) = x.clone().try_into_primitive::<Flex>() {
        // Nobody trains: this is what executors are compared with.
        convolving.by_definition = true;
        let weight = weight.clone().try_into_primitive::<Flex>().ok()?;
        let bias = bias.clone().try_into_primitive::<Flex>().ok()?;
        let (y, _) = forward(&convolving, &x, &weight, &bias);
        return Some(Tensor::from_primitive::<Flex>(y));
    }
    let x = x.clone().try_into_primitive::<Autodiff<Flex>>().ok()?;
    let weight = weight.clone().try_into_primitive::<Autodiff<Flex>>().ok()?;
    let bias = bias.clone().try_into_primitive::<Autodiff<Flex>>().ok()?;
    let (y, read) = forward(&convolving, x.primitive(), weight.primitive(), bias.primitive());
    let prepared = Differentiated.prepare::<NoCheckpointing>([x.node(), weight.node(), bias.node()]);
    let y = match prepared.compute_bound().stateful() {
        OpsKind::Tracked(ops) => ops.finish((convolving, Arc::new(read), weight.into_primitive()), y),
        OpsKind::UnTracked(ops) => ops.finish(y),
    };
    Some(Tensor::from_primitive::<Autodiff<Flex>>(y))
}

/// The graph's step back through a convolution on the processor.
#[derive(Debug)]
struct Differentiated;

impl Backward<Flex, 3> for Differentiated {
    type State = (Convolving, Arc<PaddedMaps>, FlexTensor);

    fn backward(self, ops: Ops<Self::State, 3>, gradients: &mut Gradients, _: &mut Checkpointer) {
        let [x, weight, bias] = ops.parents;
        let (convolving, read, weights) = ops.state;
        let (inputs, outputs, kernel) = (convolving.inputs, convolving.outputs, convolving.kernel);
        let [height, width] = convolving.size;
        let gradient = gradients.consume::<Flex>(&ops.node).to_contiguous();
        let places = convolving.gradient(values(&gradient));
        if let Some(x) = x {
            let of_x = convolving.input_gradient(&places, &read, values(&weights.to_contiguous()));
            let samples = of_x.len() / (inputs * height * width);
            gradients.register::<Flex>(x.id, tensor(of_x, &[samples, inputs, height, width]));
        }
        if let Some(weight) = weight {
            let of_weight = convolving.filter_gradient(&places, &read);
            gradients.register::<Flex>(weight.id, tensor(of_weight, &[outputs, inputs, kernel, kernel]));
        }
        if let Some(bias) = bias {
            gradients.register::<Flex>(bias.id, tensor(convolving.bias_gradient(&places), &[outputs]));
        }
    }
}

fn forward(
    convolving: &Convolving,
    x: &FlexTensor,
    weight: &FlexTensor,
    bias: &FlexTensor,
) -> (FlexTensor, PaddedMaps) {
    let [x, weight, bias] = [x, weight, bias].map(FlexTensor::to_contiguous);
    let (y, read) = convolving.forward(values(&x), values(&weight), values(&bias));
    let [rows, columns] = convolving.output_size();
    let samples = y.len() / (convolving.outputs * rows * columns);
    (tensor(y, &[samples, convolving.outputs, rows, columns]), read)
}

/// The numbers of a contiguous tensor in single precision; nothing of another.
fn values(tensor: &FlexTensor) -> &[f32] {
    tensor.as_slice().unwrap_or_default()
}

fn tensor(values: Vec<f32>, shape: &[usize]) -> FlexTensor {
    FlexTensor::from_data(TensorData::new(values, shape))
}
