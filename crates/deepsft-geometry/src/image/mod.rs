//! Pictures, their mipmaps, and grey values freed from light.

mod grey_image;
mod mipmap;
mod normalized_image;
mod part;
mod picture;
mod turn;

pub(crate) use grey_image::GreyImage;
pub use grey_image::luma;
pub use mipmap::{GreyLevel, GreyMipmap, MipLevel};
pub use normalized_image::NormalizedImage;
pub(crate) use normalized_image::Normalizer;
pub(crate) use part::Part;
pub use picture::Picture;
pub use turn::{turned_anticlockwise, turned_clockwise};
