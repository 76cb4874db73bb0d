//! Tests of what `deepsft-lab` uses of the command: pictures and networks by name.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

mod canvas;
mod color_map;
mod curve_plot;
mod network_choice;
mod panels;
mod sheet;
mod synthesis;
mod turntable;
mod wireframe;
