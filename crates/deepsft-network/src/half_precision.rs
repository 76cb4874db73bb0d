//! Half precision within a network.
//!
//! A network computes in the precision of the images it is given: each layer casts its weights, which stay in single
//! precision, to that of what comes in. Its maps are in single precision always, and so is what needs it on the way: the
//! standardisation of filters, batch normalisation, expected positions, geometry, and the layers that predict, where
//! they are small.

use burn::tensor::{DType, Tensor};

/// `x` in single precision where it is in half precision, else as it is.
pub fn widened<const D: usize>(x: Tensor<D>) -> Tensor<D> {
    match x.dtype() {
        DType::F16 | DType::BF16 => x.cast(DType::F32),
        _ => x,
    }
}
