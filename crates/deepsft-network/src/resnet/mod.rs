//! Residual blocks with batch normalisation, shared by the paper's network and R50F.

mod bottleneck;
#[cfg(test)]
mod gradient_test;

pub use bottleneck::Stack;
