//! Residual blocks with batch normalisation, shared by the paper's network and R50F.

mod bottleneck;
#[cfg(test)]
mod gradient_test;
mod normalised_convolution;
mod pooling;
mod weight_init;

pub use bottleneck::{Resizing, Stack};
pub use normalised_convolution::NormalisedConvolution;
pub use pooling::{crop_rows, max_pool};
pub use weight_init::WeightInit;
