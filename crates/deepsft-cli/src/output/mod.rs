//! The files that commands write: maps, meshes, picture sheets; each writer makes bytes, [`atomic`]
//! puts them in place.

pub mod atomic;
pub mod canvas;
pub mod chart;
pub mod color_map;
pub mod contact_sheet;
pub mod curve_plot;
pub mod glb;
pub mod model_card;
pub mod npy;
pub mod panels;
pub mod sheet;
pub mod surface;
pub mod turntable;
pub mod wireframe;
