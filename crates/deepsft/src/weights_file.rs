//! Files of weights: burnpack, in half precision.

use burn_pack::{Bytes, DType, Reader, Tensor, Writer};
use deepsft_inference::{WeightArray, Weights};
use half::{bf16, f16};

/// The arrays of a file.
///
/// # Errors
/// A sentence that says what is wrong with the file.
pub fn weights_from_burnpack(file: &[u8]) -> Result<Weights, String> {
    let reader = Reader::from_bytes(Bytes::from_bytes_vec(file.to_vec())).map_err(|e| e.to_string())?;
    let tensors = reader.into_tensors().map_err(|e| e.to_string())?;
    tensors.into_iter().map(read).collect()
}

fn read(tensor: Tensor) -> Result<(String, WeightArray), String> {
    let (name, kind, shape, _, bytes) = tensor.into_parts().map_err(|e| e.to_string())?;
    let values: Vec<f32> = match kind {
        DType::F32 => bytes.as_chunks().0.iter().map(|&b| f32::from_le_bytes(b)).collect(),
        DType::F16 => bytes
            .as_chunks()
            .0
            .iter()
            .map(|&b| f16::from_le_bytes(b).to_f32())
            .collect(),
        DType::BF16 => bytes
            .as_chunks()
            .0
            .iter()
            .map(|&b| bf16::from_le_bytes(b).to_f32())
            .collect(),
        kind => return Err(format!("{name} holds {kind:?}, expected F16, BF16 or F32")),
    };
    let shape = shape.to_vec();
    let expected: usize = shape.iter().product();
    if values.len() != expected {
        return Err(format!(
            "{name} has {} values, its shape {shape:?} {expected}",
            values.len()
        ));
    }
    Ok((name, WeightArray { shape, values }))
}

/// A file of `weights`, rounded to half precision.
///
/// # Errors
/// A sentence that says what cannot be encoded.
pub fn weights_to_burnpack(weights: &Weights) -> Result<Vec<u8>, String> {
    let packed = |(name, array): (&String, &WeightArray)| {
        let bytes: Vec<u8> = array
            .values
            .iter()
            .flat_map(|&value| f16::from_f32(value).to_le_bytes())
            .collect();
        let bytes = Bytes::from_bytes_vec(bytes);
        Tensor::new(name.clone(), DType::F16, array.shape.clone(), None, bytes)
    };
    let bytes = Writer::new(weights.iter().map(packed).collect()).into_bytes();
    Ok(bytes.map_err(|e| e.to_string())?.to_vec())
}
