//! The renderer: from a mesh, its texture, light and a camera to a picture and its exact maps.

pub(crate) mod black_bars;
pub(crate) mod camera_effects;
pub(crate) mod color;
pub(crate) mod figure;
pub(crate) mod frame;
pub(crate) mod projected_mesh;
pub(crate) mod shading;
pub(crate) mod silhouette;
pub(crate) mod texture;
pub(crate) mod value_noise;

pub use camera_effects::EffectsConfig;
pub use shading::LightingConfig;
