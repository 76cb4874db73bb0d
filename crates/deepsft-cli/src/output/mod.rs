//! The files that commands write: maps, meshes, picture sheets; each writer makes bytes, [`atomic`]
//! puts them in place.

pub mod canvas;
pub mod chart;
pub mod color_map;
pub mod contact_sheet;
pub mod curve_plot;
pub mod lettering;
pub mod panels;
pub mod sheet;
pub mod turntable;
pub mod wireframe;

pub use deepsft_formats as atomic;
pub use deepsft_formats as glb;
pub use deepsft_formats as npy;
