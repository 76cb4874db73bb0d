//! The pictures that commands draw: maps, meshes, sheets, curves.

pub mod canvas;
pub mod color_map;
pub mod curve_plot;
pub mod flat;
pub mod lettering;
pub mod panels;
pub mod sheet;
pub mod turntable;
pub mod wireframe;
