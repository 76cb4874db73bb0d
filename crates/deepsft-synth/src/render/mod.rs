//! The renderer: from a mesh, its texture, light and a camera to a picture and its exact maps.

mod black_bars;
mod camera_effects;
mod color;
mod figure;
mod frame;
mod printed_sheet;
mod shading;
mod silhouette;
mod texture;
mod value_noise;

pub(crate) use black_bars::Bars;
pub(crate) use camera_effects::CameraEffects;
pub use camera_effects::EffectsConfig;
pub use color::srgb8_from_linear;
pub(crate) use color::{any_color, linear_from_srgb8, vivid_color};
pub(crate) use figure::Figure;
pub(crate) use frame::Frame;
pub(crate) use printed_sheet::{each_seen, paint_sheet};
pub use shading::LightingConfig;
pub(crate) use shading::{Lighting, Paper};
pub(crate) use silhouette::silhouette;
pub(crate) use texture::Texture;
pub use value_noise::{ValueNoise, floor};
