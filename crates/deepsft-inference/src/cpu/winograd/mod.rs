//! 3 x 3 convolutions in a quarter of the multiplications: Winograd's F(4 x 4, 3 x 3) and F(2 x 2, 3 x 3).
//!
//! Lavin and Gray, "Fast Algorithms for Convolutional Neural Networks" (CVPR 2016), section 4. The output is cut into tiles of 4 x 4
//! positions. Each reads 6 x 6; a linear map B takes them to 36 numbers, its points, at each of which the convolution is a product of matrices
//! over the channels, and a linear map A takes the sums back. In single precision the results differ from direct sums by about 1e-6
//! of the largest number read. Tiles of 2 x 2 need more multiplications and fewer filters: wide layers of small maps take as long as
//! their filters take to come from memory.
//!
//! A convolution of an up-sampled map is done before the up-sampling: there are `factor` x `factor` kinds of positions, and each kind's
//! filters, summed over the positions that share a number, are again 3 x 3.

mod convolution;
mod filters;
mod tiling;
mod transforms;

pub(crate) use convolution::Winograd;
#[cfg(feature = "webgpu")]
pub(crate) use filters::{POINTS, READ, TILE, filter_at_point};
pub use transforms::{InputLines, LineTransform, OutputLines, both_ways, plus};
