//! Files of weights: burnpack. Filters are integers of 8 bits times a step of each filter's own, all else is in half precision.

use crate::error::DeepSftError;
use burn_pack::{Bytes, DType, Reader, Tensor, Writer};
use deepsft_inference::{WeightArray, Weights};
use half::{bf16, f16};
use std::collections::BTreeMap;

/// The steps of the filters `name` are the array `name.step`.
const STEP: &str = ".step";

/// The largest integer that a weight becomes.
const LARGEST: f32 = 127.0;

/// Bits of a step's mantissa that are zero: an integer times a step is exact, so what was read is written as the same file.
const FREE_BITS: u32 = 8;

/// An array as a file has it.
enum Stored {
    Values(WeightArray),
    /// To be multiplied by the steps of another array.
    Integers(Vec<usize>, Vec<i8>),
}

/// The arrays of a file: those in single or half precision as they are, those of integers of 8 bits times the steps that lie
/// beside them, one for each part along their first axis.
///
/// # Errors
/// [`DeepSftError::Weights`] says what is wrong with the file.
pub fn weights_from_burnpack(file: &[u8]) -> Result<Weights, DeepSftError> {
    decoded(file).map_err(DeepSftError::Weights)
}

fn decoded(file: &[u8]) -> Result<Weights, String> {
    let reader = Reader::from_bytes(Bytes::from_bytes_vec(file.to_vec())).map_err(|e| e.to_string())?;
    let tensors = reader.into_tensors().map_err(|e| e.to_string())?;
    let mut stored = tensors
        .into_iter()
        .map(read)
        .collect::<Result<BTreeMap<_, _>, String>>()?;
    let names: Vec<String> = stored.keys().cloned().collect();
    let mut weights = Weights::new();
    for name in names {
        let array = match stored.remove(&name) {
            // Taken with the integers before it.
            None => continue,
            Some(Stored::Values(array)) => array,
            Some(Stored::Integers(shape, integers)) => {
                let filters = shape.first().copied().unwrap_or_default();
                let steps = match stored.remove(&format!("{name}{STEP}")) {
                    Some(Stored::Values(steps)) if steps.shape == [filters] => steps.values,
                    _ => return Err(format!("{name} holds integers without {filters} steps {name}{STEP}")),
                };
                let length = (integers.len() / filters.max(1)).max(1);
                let parts = integers.chunks(length).zip(steps);
                let values = parts.flat_map(|(part, step)| part.iter().map(move |&integer| f32::from(integer) * step));
                WeightArray {
                    values: values.collect(),
                    shape,
                }
            }
        };
        weights.insert(name, array);
    }
    Ok(weights)
}

fn read(tensor: Tensor) -> Result<(String, Stored), String> {
    let (name, kind, shape, _, bytes) = tensor.into_parts().map_err(|e| e.to_string())?;
    let shape = shape.to_vec();
    // Kinds of numbers that are refused below may have any shape.
    let check = |actual: usize| match shape
        .iter()
        .try_fold(1_usize, |product, &side| product.checked_mul(side))
    {
        Some(expected) if expected == actual => Ok(()),
        _ => Err(format!(
            "{name} has {actual} values, which do not fit its shape {shape:?}"
        )),
    };
    let pairs = || bytes.as_chunks().0.iter();
    let values: Vec<f32> = match kind {
        DType::F32 => bytes.as_chunks().0.iter().map(|&b| f32::from_le_bytes(b)).collect(),
        DType::F16 => pairs().map(|&b| f16::from_le_bytes(b).to_f32()).collect(),
        DType::BF16 => pairs().map(|&b| bf16::from_le_bytes(b).to_f32()).collect(),
        DType::I8 => {
            check(bytes.len())?;
            let integers = bytes.iter().map(|&b| i8::from_le_bytes([b])).collect();
            return Ok((name, Stored::Integers(shape, integers)));
        }
        kind => return Err(format!("{name} holds {kind:?}, expected I8, F16, BF16 or F32")),
    };
    check(values.len())?;
    Ok((name, Stored::Values(WeightArray { shape, values })))
}

/// A file of `weights`. Filters and matrices are rounded to integers of 8 bits, whose steps are so large as each part along the
/// first axis needs; arrays of one axis are rounded to half precision.
///
/// # Errors
/// [`DeepSftError::Weights`] says what cannot be encoded, such as a weight that is not finite, or a bias beyond 65,504.
pub fn weights_to_burnpack(weights: &Weights) -> Result<Vec<u8>, DeepSftError> {
    encoded(weights).map_err(DeepSftError::Weights)
}

fn encoded(weights: &Weights) -> Result<Vec<u8>, String> {
    let mut tensors = Vec::new();
    let mut push = |name: String, kind, shape: &[usize], bytes: Vec<u8>| {
        let bytes = Bytes::from_bytes_vec(bytes);
        tensors.push(Tensor::new(name, kind, shape.to_vec(), None, bytes));
    };
    for (name, WeightArray { shape, values }) in weights {
        let is_bias = shape.len() < 2;
        let fits = |&value: &f32| value.is_finite() && (!is_bias || f16::from_f32(value).is_finite());
        if !values.iter().all(fits) {
            return Err(format!("{name} holds a weight that is not finite or too large"));
        }
        if is_bias {
            let halves = values.iter().flat_map(|&value| f16::from_f32(value).to_le_bytes());
            push(name.clone(), DType::F16, shape, halves.collect());
            continue;
        }
        let length = (values.len() / shape[0].max(1)).max(1);
        let steps: Vec<f32> = values.chunks(length).map(step).collect();
        let parts = values.chunks(length).zip(&steps);
        let integers = parts.flat_map(|(part, &step)| part.iter().map(move |&value| integer(value, step)));
        push(name.clone(), DType::I8, shape, integers.collect());
        let steps: Vec<u8> = steps.iter().flat_map(|step| step.to_le_bytes()).collect();
        push(format!("{name}{STEP}"), DType::F32, &shape[..1], steps);
    }
    let bytes = Writer::new(tensors).into_bytes();
    Ok(bytes.map_err(|e| e.to_string())?.to_vec())
}

/// The least step of few digits with which all of `part` are integers of 8 bits.
fn step(part: &[f32]) -> f32 {
    let largest = part.iter().fold(0.0_f32, |most, value| most.max(value.abs()));
    let free = (1_u32 << FREE_BITS) - 1;
    let exact = (largest / LARGEST).to_bits();
    f32::from_bits(exact.saturating_add(free) & !free)
}

fn integer(value: f32, step: f32) -> u8 {
    let steps = if step > 0.0 { (value / step).round() } else { 0.0 };
    (steps as i8).to_le_bytes()[0]
}
