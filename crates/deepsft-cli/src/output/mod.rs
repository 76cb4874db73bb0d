//! The files that commands write: maps, meshes, picture sheets; each writer makes bytes, [`atomic`]
//! puts them in place.

mod canvas;
mod chart;
pub mod color_map;
pub mod contact_sheet;
pub mod curve_plot;
pub mod model_card;
pub mod panels;
pub mod sheet;
pub mod study_plot;
pub mod study_table;
pub mod surface;
pub mod track_plot;
pub mod turntable;
pub mod wireframe;

pub use deepsft_formats as atomic;
pub use deepsft_formats as glb;
pub use deepsft_formats as npy;
