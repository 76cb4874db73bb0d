//! Depth and registration maps: drawn from a mesh, measured against the truth and against the image.

mod color_response;
mod depth_and_registration;
mod islands;
pub mod metrics;
mod photo_consistency;
pub mod raster;
mod visible_surface;

pub use color_response::{ColorMatch, ColorResponse};
pub use depth_and_registration::{Maps, OUTSIDE};
pub(crate) use islands::erode;
pub use islands::remove_islands;
pub(crate) use photo_consistency::PairedSums;
pub use photo_consistency::{draw_template, mipmap_level, photo_consistency_error, relit_photo_consistency_error};
pub use visible_surface::visible_surface;
