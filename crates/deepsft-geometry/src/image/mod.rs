//! Pictures, and grey values freed from light.

mod normalized_image;
mod picture;

pub use normalized_image::NormalizedImage;
pub(crate) use normalized_image::{GreyImage, Normalizer};
pub use picture::Picture;
