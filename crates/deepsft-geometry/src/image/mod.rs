//! Pictures, their mipmaps, and grey values freed from light.

mod contrast_normalization;
mod grey_image;
mod image_size;
mod mipmap;
mod picture;

pub use contrast_normalization::ContrastNormalizedImage;
pub(crate) use contrast_normalization::ContrastNormalizer;
pub(crate) use grey_image::GreyImage;
pub use grey_image::{Region, luma};
pub use image_size::ImageSize;
pub use mipmap::{GreyMipmap, MipLevel};
pub use picture::{Picture, turned_anticlockwise, turned_clockwise};
